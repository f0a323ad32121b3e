# cmake -DGENERATOR= -DPROGRAM= -DMODULE= -DDATA= -DSOURCE= -DFOLDER= -P run.cmake
# Builds a foreign project that bakes: a first build bakes, a second does not; after a curve file that
# only the recipe names is touched, and after it really changes, the next build bakes once.
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})
file(COPY ${SOURCE}/CMakeLists.txt DESTINATION ${FOLDER})
file(COPY ${DATA}/tressfx/tail.tfx ${DATA}/tressfx/back.tfx DESTINATION ${FOLDER})
file(WRITE ${FOLDER}/hair.json "{ \"scale\": 0.0027, \"curves\": [ { \"file\": \"tail.tfx\" } ] }\n")

execute_process(COMMAND ${CMAKE_COMMAND} -G ${GENERATOR} -S ${FOLDER} -B ${FOLDER}/build
  -DKERATIN_BAKE_PROGRAM=${PROGRAM} -DKERATIN_BAKE_CMAKE=${MODULE}
  RESULT_VARIABLE failed OUTPUT_VARIABLE text ERROR_VARIABLE text)
if(failed)
  message(FATAL_ERROR "${text}")
endif()

function(build expected when)
  # File times of some systems count in seconds or clock ticks.
  execute_process(COMMAND ${CMAKE_COMMAND} -E sleep 0.1)
  execute_process(COMMAND ${CMAKE_COMMAND} --build ${FOLDER}/build
    RESULT_VARIABLE failed OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(failed)
    message(FATAL_ERROR "${when}: ${text}")
  endif()
  set(baked FALSE)
  if(text MATCHES "Baking hair.kera")
    set(baked TRUE)
  endif()
  if(NOT baked STREQUAL expected)
    message(FATAL_ERROR "${when}: baked is ${baked} instead of ${expected}\n${text}")
  endif()
endfunction()

build(TRUE "first build")
build(FALSE "nothing changed")
execute_process(COMMAND ${CMAKE_COMMAND} -E sleep 1.1)
file(TOUCH ${FOLDER}/tail.tfx)
build(TRUE "curves touched")
if(GENERATOR MATCHES "Ninja")
  # The asset keeps its old time, so Ninja may look once more; it must not rebuild what follows.
  execute_process(COMMAND ${CMAKE_COMMAND} --build ${FOLDER}/build OUTPUT_QUIET)
endif()
build(FALSE "after the touched curves")
file(SHA256 ${FOLDER}/build/hair.kera before)
execute_process(COMMAND ${CMAKE_COMMAND} -E sleep 1.1)
file(COPY_FILE ${FOLDER}/back.tfx ${FOLDER}/tail.tfx)
file(TOUCH ${FOLDER}/tail.tfx)
build(TRUE "curves changed")
build(FALSE "after the changed curves")
file(SHA256 ${FOLDER}/build/hair.kera after)
if(before STREQUAL after)
  message(FATAL_ERROR "other curves gave the same asset")
endif()
