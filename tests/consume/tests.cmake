# Builds the project in this folder in both ways and runs it on an asset.
set(consume ${CMAKE_CURRENT_BINARY_DIR}/consume)
set(asset ${PROJECT_SOURCE_DIR}/data/revision/asset-1.0.kera)
set(common --build-generator ${CMAKE_GENERATOR} --build-noclean --build-options
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
  -DCMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER})

add_test(NAME "consume: cmake --install fills a prefix"
  COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${consume}/prefix)
set_tests_properties("consume: cmake --install fills a prefix" PROPERTIES FIXTURES_SETUP keratin_prefix)

add_test(NAME "consume: a project that finds the package simulates an asset"
  COMMAND ${CMAKE_CTEST_COMMAND} --build-and-test ${CMAKE_CURRENT_LIST_DIR} ${consume}/installed
    ${common} -DCMAKE_PREFIX_PATH=${consume}/prefix --test-command game ${asset})
set_tests_properties("consume: a project that finds the package simulates an asset" PROPERTIES
  FIXTURES_REQUIRED keratin_prefix PASS_REGULAR_EXPRESSION "7 strands after 1 s")

# The libraries are compiled once more here, which takes a while the first time.
add_test(NAME "consume: a project that holds the sources simulates an asset"
  COMMAND ${CMAKE_CTEST_COMMAND} --build-and-test ${CMAKE_CURRENT_LIST_DIR} ${consume}/subdirectory
    ${common} -DKERATIN_SOURCE=${PROJECT_SOURCE_DIR} --test-command game ${asset})
set_tests_properties("consume: a project that holds the sources simulates an asset" PROPERTIES
  TIMEOUT 1500 PASS_REGULAR_EXPRESSION "7 strands after 1 s")
