# Compares the output of PROGRAM, which is golden_walk, with the file EXPECTED.
execute_process(COMMAND ${PROGRAM} OUTPUT_VARIABLE lines RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} failed: ${result}")
endif()
file(READ ${EXPECTED} expected)
if(NOT lines STREQUAL expected)
  message(FATAL_ERROR "the hashes of the golden walks changed; printed:\n${lines}expected:\n${expected}"
    "If no result was meant to change, this is a bug. Otherwise write the output of ${PROGRAM} "
    "to ${EXPECTED}, and say in CHANGELOG.md what changed and why.")
endif()
