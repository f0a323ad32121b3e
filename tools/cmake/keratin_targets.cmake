# What every keratin target shares: language level, warnings, and the floating-point rules that
# make results equal on every instruction set (no contraction; sqrt without errno so that it
# vectorises).

find_program(KERATIN_FLATC flatc REQUIRED)
find_path(KERATIN_FLATBUFFERS_INCLUDE flatbuffers/flatbuffers.h REQUIRED)

add_library(keratin_options INTERFACE)
target_compile_features(keratin_options INTERFACE cxx_std_20)
target_compile_options(keratin_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wno-psabi
  # g++ 12 warns of overlapping copies inside std::string's own operator+ (GCC bug 105651).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  -ffp-contract=off -fno-math-errno -fvisibility=hidden -fvisibility-inlines-hidden
  $<$<BOOL:${KERATIN_WERROR}>:-Werror>)
if(KERATIN_WITH_FUZZ)
  target_compile_options(keratin_options INTERFACE -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
  target_link_options(keratin_options INTERFACE -fsanitize=address,undefined)
endif()
if(KERATIN_SANITIZE)
  # Reports need lines, not the place of every variable: g++ follows those through the instrumented
  # passes for minutes a file.
  target_compile_options(keratin_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
    $<$<CXX_COMPILER_ID:GNU>:-fno-var-tracking>)
  target_link_options(keratin_options INTERFACE -fsanitize=address,undefined)
endif()

# keratin_library(NAME sources...): static library keratin_NAME with the alias keratin::NAME.
function(keratin_library name)
  add_library(keratin_${name} STATIC ${ARGN})
  add_library(keratin::${name} ALIAS keratin_${name})
  set_target_properties(keratin_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(keratin_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/keratin>)
  target_compile_features(keratin_${name} PUBLIC cxx_std_20)
  target_link_libraries(keratin_${name} PRIVATE $<BUILD_INTERFACE:keratin_options>)
endfunction()

# keratin_program(NAME sources...): executable keratin-NAME.
function(keratin_program name)
  add_executable(keratin-${name} ${ARGN})
  target_include_directories(keratin-${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(keratin-${name} PRIVATE keratin_options)
  set_target_properties(keratin-${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
endfunction()

# keratin_text_sources(files...): sources that read, check and write text. The templates of CLI11 and
# nlohmann-json take several times as long to compile at -O3 as at -O1, and nothing there is a hot loop.
function(keratin_text_sources)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O1>)
endfunction()

# keratin_flatbuffers(target file.fbs...): generates file_generated.h for the private use of target.
function(keratin_flatbuffers target)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/generated)
  foreach(fbs ${ARGN})
    get_filename_component(path ${fbs} ABSOLUTE)
    get_filename_component(stem ${fbs} NAME_WE)
    add_custom_command(OUTPUT ${out}/${stem}_generated.h
      COMMAND ${KERATIN_FLATC} --cpp --scoped-enums --require-explicit-ids -o ${out} ${path}
      DEPENDS ${path} COMMENT "flatc ${stem}.fbs" VERBATIM)
    target_sources(${target} PRIVATE ${out}/${stem}_generated.h)
  endforeach()
  target_include_directories(${target} SYSTEM PRIVATE ${out} ${KERATIN_FLATBUFFERS_INCLUDE})
endfunction()

# keratin_embed_text(target VARIABLE file): makes the text of file available to target as the
# string literal VARIABLE through the header VARIABLE.h.
function(keratin_embed_text target variable file)
  get_filename_component(path ${file} ABSOLUTE)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/generated/${variable}.h)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path})
  file(READ ${path} text)
  file(CONFIGURE OUTPUT ${out} CONTENT "#pragma once\ninline constexpr char ${variable}[] = R\"KERATIN(@text@)KERATIN\";\n" @ONLY)
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/generated)
endfunction()
