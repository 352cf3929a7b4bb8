# Debian's own, whose packages (python3-pymodbus) another Python on PATH does not see.
find_program(AXLECAST_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)

# axlecast_process_tests(PREFIX)
#
# The test_*.py of this folder: real processes, each case in a network of its own and as one entry of ctest, so that a
# failure names itself. They find tests/e2e/machine.py and its neighbours by PYTHONPATH.
function(axlecast_process_tests prefix)
  set(shared ${CMAKE_SOURCE_DIR}/tests/e2e)
  file(GLOB suites CONFIGURE_DEPENDS test_*.py)
  foreach(suite ${suites})
    get_filename_component(name ${suite} NAME_WE)
    string(REPLACE test_ "" short ${name})
    file(STRINGS ${suite} lines REGEX "^class [A-Za-z]+\\(.*\\):|^    def test_[a-z0-9_]+")
    set(class "")
    foreach(line ${lines})
      if(line MATCHES "^class ([A-Za-z]+)")
        set(class ${CMAKE_MATCH_1})
      elseif(line MATCHES "def (test_[a-z0-9_]+)")
        set(test ${prefix}.${short}.${CMAKE_MATCH_1})
        add_test(NAME ${test}
          COMMAND ${shared}/in_namespace.sh /usr/bin/env PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=${shared}
            AXLECAST_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY} AXLECAST_SOURCE=${CMAKE_SOURCE_DIR}
            ${AXLECAST_PYTHON} ${suite} -v ${class}.${CMAKE_MATCH_1}
          WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
        set_tests_properties(${test} PROPERTIES TIMEOUT 300)
      endif()
    endforeach()
  endforeach()
endfunction()
