# Run after a GoogleTest program is linked: writes a ctest file with an entry for each of its test suites. What tests of a suite share, a baked
# body, is then made once a suite and not once a test.
#   cmake -D program=PATH -D file=PATH -D label=LABEL -D environment=LIST -P discover_suites.cmake
execute_process(COMMAND ${program} --gtest_list_tests OUTPUT_VARIABLE list RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${program} --gtest_list_tests ends with ${status}:\n${list}")
endif()
string(REGEX MATCHALL "\n[^ \n]+\\." suites "\n${list}")
get_filename_component(name ${program} NAME)
set(entries "")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "^\n(.*)\\.$" "\\1" suite "${suite}")
  string(APPEND entries "add_test([=[${name}.${suite}]=] [=[${program}]=] [=[--gtest_filter=${suite}.*]=])\n"
                        "set_tests_properties([=[${name}.${suite}]=] PROPERTIES TIMEOUT 1200 LABELS [=[${label}]=] ENVIRONMENT [=[${environment}]=])\n")
endforeach()
if(entries STREQUAL "")
  message(FATAL_ERROR "${program} has no tests")
endif()
file(WRITE ${file} "${entries}")
