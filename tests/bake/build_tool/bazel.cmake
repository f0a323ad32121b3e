# cmake -DBAZEL= -DPROGRAM= -DRULE= -DDATA= -DFOLDER= -P bazel.cmake
# A foreign workspace bakes with the Bazel rule, in a sandbox that holds declared files only.
file(REMOVE_RECURSE ${FOLDER}/work)
file(MAKE_DIRECTORY ${FOLDER}/work)
get_filename_component(program_folder ${PROGRAM} DIRECTORY)
file(COPY ${RULE} ${DATA}/tressfx/tail.tfx DESTINATION ${FOLDER}/work)
file(WRITE ${FOLDER}/work/WORKSPACE "new_local_repository(
    name = \"keratin\",
    path = \"${program_folder}\",
    build_file_content = \"exports_files([\\\"keratin-bake\\\"])\",
)\n")
file(WRITE ${FOLDER}/work/hair.json "{ \"scale\": 0.0027, \"curves\": [ { \"file\": \"tail.tfx\" } ] }\n")
function(rules srcs)
  file(WRITE ${FOLDER}/work/BUILD "load(\":keratin_bake.bzl\", \"keratin_bake\")
keratin_bake(name = \"hair\", recipe = \"hair.json\", srcs = [${srcs}], program = \"@keratin//:keratin-bake\")\n")
endfunction()

function(bazel result)
  execute_process(COMMAND ${BAZEL} --batch --output_user_root=${FOLDER}/root build //:hair
    WORKING_DIRECTORY ${FOLDER}/work RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text)
  set(${result} ${code} PARENT_SCOPE)
  set(text "${text}" PARENT_SCOPE)
endfunction()

rules("\"tail.tfx\"")
bazel(code)
if(code)
  message(FATAL_ERROR "${text}")
endif()
execute_process(COMMAND ${PROGRAM} --check ${FOLDER}/work/bazel-bin/hair.kera --quiet RESULT_VARIABLE damaged)
if(damaged)
  message(FATAL_ERROR "no sound asset\n${text}")
endif()
# A file that is not declared is not there, and the message names it.
rules("")
bazel(code)
if(NOT code OR NOT text MATCHES "tail.tfx")
  message(FATAL_ERROR "an undeclared file was read\n${text}")
endif()
# Bazel makes its folders read-only.
execute_process(COMMAND chmod -R u+w ${FOLDER})
file(REMOVE_RECURSE ${FOLDER})
