# keratin_bake(NAME RECIPE groom.json OUTPUT head.kera [ALL] [STRICT] [THREADS n] [ARGUMENTS ...])
#
# Adds a target NAME that bakes the recipe into OUTPUT (relative to the binary folder) whenever the
# recipe, or any file that the last bake read, is newer. With ALL it is part of the default build.
# Works with Ninja and Make.
#
# The program is the target keratin::keratin-bake where there is one, else KERATIN_BAKE_PROGRAM, else
# keratin-bake from the PATH.

include_guard(GLOBAL)

function(keratin_bake name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "ALL;STRICT" "RECIPE;OUTPUT;THREADS" "ARGUMENTS")
  if(arg_UNPARSED_ARGUMENTS OR NOT arg_RECIPE OR NOT arg_OUTPUT)
    message(FATAL_ERROR "keratin_bake(NAME RECIPE file OUTPUT file [ALL] [STRICT] [THREADS n] [ARGUMENTS ...])")
  endif()
  if(TARGET keratin::keratin-bake)
    set(program keratin::keratin-bake)
  elseif(TARGET keratin-bake)
    set(program keratin-bake)
  else()
    find_program(KERATIN_BAKE_PROGRAM keratin-bake REQUIRED)
    set(program ${KERATIN_BAKE_PROGRAM})
  endif()
  get_filename_component(recipe ${arg_RECIPE} ABSOLUTE)
  get_filename_component(output ${arg_OUTPUT} ABSOLUTE BASE_DIR ${CMAKE_CURRENT_BINARY_DIR})

  set(options --quiet)
  if(arg_STRICT)
    list(APPEND options --strict)
  endif()
  if(arg_THREADS)
    list(APPEND options --threads ${arg_THREADS})
  endif()
  # Ninja looks at an output's time again after the command: one that did not change stops what
  # follows. Make would run the command for ever.
  if(CMAKE_GENERATOR MATCHES "Ninja")
    list(APPEND options --keep-mtime)
  endif()
  add_custom_command(OUTPUT ${output}
    COMMAND ${program} ${recipe} -o ${output} --depfile ${output}.d ${options} ${arg_ARGUMENTS}
    DEPENDS ${recipe} ${program}
    DEPFILE ${output}.d
    COMMENT "Baking ${arg_OUTPUT}" VERBATIM)
  set(all)
  if(arg_ALL)
    set(all ALL)
  endif()
  add_custom_target(${name} ${all} DEPENDS ${output})
endfunction()
