# A test in the folder of a family of devices fails when it runs no product code of that family: such a test only
# compares its own arithmetic with itself, whatever its name promises. The family's libraries are compiled so that
# each function calls a hook, which costs too little to be measured.
# tests/support/product_code_check.cpp, linked into the family's test programs, receives the calls; in every other
# program product_code_hook.cpp, which each of the libraries holds, receives them and does nothing.
option(AXLECAST_PRODUCT_CODE_CHECK "Fail tests of a family that run none of its product code (clang)" OFF)
if(AXLECAST_PRODUCT_CODE_CHECK AND NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
  message(FATAL_ERROR "AXLECAST_PRODUCT_CODE_CHECK needs clang: set CMAKE_CXX_COMPILER to clang++-14, or the option to OFF")
endif()

# axlecast_product_code(TARGET): the functions of this library count as product code.
function(axlecast_product_code target)
  if(AXLECAST_PRODUCT_CODE_CHECK)
    target_compile_options(${target} PRIVATE -finstrument-function-entry-bare)
  endif()
  target_sources(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests/support/product_code_hook.cpp)
endfunction()

# axlecast_product_code_tests(TARGET): each test of this program must run product code.
function(axlecast_product_code_tests target)
  target_sources(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests/support/product_code_check.cpp)
endfunction()

# axlecast_check_product_code(TARGET): applies both to the library TARGET and to the program TARGET_test, if there are
# any, where the current folder is drivers/FAMILY or lies below it. A folder with a family.cpp is a family.
function(axlecast_check_product_code target)
  if(NOT AXLECAST_PRODUCT_CODE_CHECK)
    return()
  endif()
  file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR}/drivers ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "/.*" "" family ${folder})
  if(NOT EXISTS ${CMAKE_SOURCE_DIR}/drivers/${family}/family.cpp)
    return()
  endif()
  get_target_property(type ${target} TYPE)
  if(NOT type STREQUAL INTERFACE_LIBRARY)
    axlecast_product_code(${target})
  endif()
  if(TARGET ${target}_test)
    axlecast_product_code_tests(${target}_test)
  endif()
endfunction()
