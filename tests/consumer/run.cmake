# Run with cmake -P: BUILD (tree to install), SOURCE (the consumer), CONFIG, GENERATOR, CXX, FLAGS, CALIB (whether
# flash::calib is installed).
set(work ${BUILD}/consumer)
file(REMOVE_RECURSE ${work})

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    string(JOIN " " command ${ARGV})
    message(FATAL_ERROR "${command}: ${status}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --config ${CONFIG} --prefix ${work}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${work}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=${CONFIG}
    -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_FLAGS=${FLAGS} -DCMAKE_PREFIX_PATH=${work}/prefix)
run(${CMAKE_COMMAND} --build ${work}/build --config ${CONFIG})
run(${work}/build/consumer)

# Ten steps of 0.01 s of implicit Euler from rest fall by g h^2 n (n + 1) / 2 = 9.81 * 1e-4 * 55 = 0.0539550 m.
if(NOT output MATCHES "^-0\\.05395")
  message(FATAL_ERROR "the consumer printed ${output}, expected -0.05395")
endif()

run(${work}/build/worlds)
# A corner that is taken on the table follows the gripper to 0.1 m.
string(REGEX MATCHALL "environment [0-3]: its corner is at 0\\.100 m, the gripper pulls 0\\.[0-9]+ N \n" lifted "${output}")
list(LENGTH lifted count)
if(NOT count EQUAL 4)
  message(FATAL_ERROR "the example printed ${output}, expected four corners at 0.100 m")
endif()

if(CALIB)
  run(${work}/build/hand_eye)
  # The camera of these pairs, which are exact, is at (1, 0.5, 0.25) m.
  run(${work}/build/example ${SOURCE}/samples.json)
  if(NOT output MATCHES "^base <- camera:\n[^\n]* 1 *\n[^\n]* 0.5 *\n[^\n]* 0.25 *\n")
    message(FATAL_ERROR "the example printed ${output}, expected a camera at (1, 0.5, 0.25)")
  endif()
endif()
