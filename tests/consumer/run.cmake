# Installs the build in BINARY_DIR under WORK_DIR, then configures, builds and runs the consumer in SOURCE_DIR against it.
#   cmake -D BINARY_DIR=... -D SOURCE_DIR=... -D WORK_DIR=... -D CONFIG=... [-D CXX=... -D CXX_FLAGS=...] -P run.cmake
file(REMOVE_RECURSE "${WORK_DIR}")

function(step name)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "consumer: ${name} failed (${result}):\n${output}")
  endif()
  message(STATUS "consumer: ${name}\n${output}")
endfunction()

step("install" "${CMAKE_COMMAND}" --install "${BINARY_DIR}" --prefix "${WORK_DIR}/prefix")
step("configure" "${CMAKE_COMMAND}" -G Ninja -S "${SOURCE_DIR}" -B "${WORK_DIR}/build"
     "-DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix" "-DCMAKE_BUILD_TYPE=${CONFIG}" "-DCMAKE_CXX_COMPILER=${CXX}"
     "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}" -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
step("build" "${CMAKE_COMMAND}" --build "${WORK_DIR}/build")
step("run" "${WORK_DIR}/build/consumer")
step("installed command" "${WORK_DIR}/prefix/bin/rayrep" --version)
