# What `cmake --install` puts under the prefix: the programs that were built, the libraries a game
# links with their headers (include/keratin is the include path, so <schema/...> and <runtime/...>
# read as in the sources), and the package that find_package(keratin) finds.
include(CMakePackageConfigHelpers)

set(KERATIN_SCHEMA_HEADERS
  schema/asset.h schema/asset_view.h schema/fields.h schema/layout.h schema/result.h)
set(KERATIN_RUNTIME_HEADERS
  runtime/host.h runtime/keratin.h runtime/lane/instruction_set.h runtime/plan.h runtime/settings.h runtime/simulation.h)
foreach(header IN LISTS KERATIN_SCHEMA_HEADERS KERATIN_RUNTIME_HEADERS)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/${header} DESTINATION include/keratin/${folder})
endforeach()

install(TARGETS keratin_schema keratin_lane keratin_runtime EXPORT keratin
  ARCHIVE DESTINATION lib INCLUDES DESTINATION include/keratin)
install(EXPORT keratin NAMESPACE keratin:: DESTINATION lib/cmake/keratin)

foreach(program bake run diff view bench report)
  if(TARGET keratin-${program})
    install(TARGETS keratin-${program} EXPORT keratin RUNTIME DESTINATION bin)
  endif()
endforeach()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/keratin-config.cmake.in
  ${PROJECT_BINARY_DIR}/keratin-config.cmake INSTALL_DESTINATION lib/cmake/keratin)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/keratin-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/keratin-config.cmake ${PROJECT_BINARY_DIR}/keratin-config-version.cmake
  ${CMAKE_CURRENT_LIST_DIR}/keratin_bake.cmake DESTINATION lib/cmake/keratin)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION share/doc/keratin)
