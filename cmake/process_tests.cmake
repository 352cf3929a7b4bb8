# Debian's own, whose packages (python3-pymodbus) another Python on PATH does not see.
find_program(AXLECAST_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)

# axlecast_python_cases(RESULT SUITE): the cases of a suite, each as Class.test. Another case makes CMake run again.
function(axlecast_python_cases result suite)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${suite})
  file(STRINGS ${suite} lines REGEX "^class [A-Za-z]+\\(.*\\):|^    def test_[a-z0-9_]+")
  set(cases "")
  foreach(line ${lines})
    if(line MATCHES "^class ([A-Za-z]+)")
      set(class ${CMAKE_MATCH_1})
    elseif(line MATCHES "def (test_[a-z0-9_]+)")
      list(APPEND cases ${class}.${CMAKE_MATCH_1})
    endif()
  endforeach()
  set(${result} ${cases} PARENT_SCOPE)
endfunction()

# axlecast_process_tests(PREFIX [CAMPAIGN suite...] [PROPERTIES name value...])
#
# The test_*.py of this folder: real processes, each case in a network of its own and as one entry of ctest, so that a
# failure names itself. CAMPAIGN: suites that only `ctest -C campaign` runs. They find tests/e2e/machine.py and its neighbours by PYTHONPATH.
function(axlecast_process_tests prefix)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "PROPERTIES;CAMPAIGN")  # unlike ARGN, it keeps a list that is one value
  set(shared ${CMAKE_SOURCE_DIR}/tests/e2e)
  file(GLOB suites CONFIGURE_DEPENDS test_*.py)
  foreach(suite ${suites})
    get_filename_component(name ${suite} NAME_WE)
    string(REPLACE test_ "" short ${name})
    axlecast_python_cases(cases ${suite})
    set(configuration)
    if(short IN_LIST ARG_CAMPAIGN)
      set(configuration CONFIGURATIONS campaign)
    endif()
    foreach(case ${cases})
      string(REGEX REPLACE "^.*\\." "" method ${case})
      set(test ${prefix}.${short}.${method})
      add_test(NAME ${test} ${configuration}
        COMMAND ${shared}/in_namespace.sh /usr/bin/env PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=${shared}
          AXLECAST_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY} AXLECAST_SOURCE=${CMAKE_SOURCE_DIR}
          ${AXLECAST_PYTHON} ${suite} -v ${case}
        WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
      set_tests_properties(${test} PROPERTIES TIMEOUT 300 ${ARG_PROPERTIES})
    endforeach()
  endforeach()
endfunction()
