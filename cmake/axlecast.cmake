include(product_code)

# What tools/demo, tools/test and tools/campaign ask for by name.
add_custom_target(axlecast_programs)
add_custom_target(axlecast_unit_tests)
add_custom_target(axlecast_fuzzers)

add_library(axlecast_flags INTERFACE)
target_include_directories(axlecast_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(axlecast_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
  "$<$<COMPILE_LANGUAGE:CXX>:-Wold-style-cast;-Wnon-virtual-dtor;-Woverloaded-virtual>" -Werror
  # g++ 12 warns of overlapping and too long copies in its own operator+ of strings (GCC bug 105651). clang checks both.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -Wno-array-bounds>)
if(AXLECAST_SANITIZE)
  target_compile_options(axlecast_flags INTERFACE -fsanitize=${AXLECAST_SANITIZE} -fno-sanitize-recover=all
    -fno-omit-frame-pointer)
  if(AXLECAST_SANITIZE_NOT)
    target_compile_options(axlecast_flags INTERFACE -fno-sanitize=${AXLECAST_SANITIZE_NOT})
  endif()
  # lld links a program with sanitizers in a fraction of the time of GNU ld.
  target_link_options(axlecast_flags INTERFACE -fsanitize=${AXLECAST_SANITIZE} $<$<CXX_COMPILER_ID:Clang>:-fuse-ld=lld>)
endif()

# What a user may install is hardened, whatever the build type. Sanitizers check more than these, and exclude some of them.
if(AXLECAST_HARDENING AND AXLECAST_PACKAGING AND NOT AXLECAST_SANITIZE)
  include(hardening)
endif()

# Optimising the tests themselves, or searching them for undefined behaviour, would take twice their time to compile.
# Linked last, so that these options are the last ones.
add_library(axlecast_test_flags INTERFACE)
target_compile_options(axlecast_test_flags INTERFACE -O0 -g1
  "SHELL:-U _FORTIFY_SOURCE")  # needs optimisation; written so, it is not taken for a duplicate of hardening's
if(AXLECAST_SANITIZE MATCHES undefined)
  target_compile_options(axlecast_test_flags INTERFACE -fno-sanitize=undefined)
endif()

if(AXLECAST_FUZZERS)
  # The libraries too, so that the fuzzers see which of their branches an input reaches.
  target_compile_options(axlecast_flags INTERFACE -fsanitize=fuzzer-no-link)
  target_compile_options(axlecast_test_flags INTERFACE -fno-sanitize=fuzzer-no-link)
endif()

# GoogleMock's headers and those that most tests include cost more than most tests: they are compiled once for all.
if(AXLECAST_TESTS)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/test_headers.cpp CONTENT "")
  add_library(axlecast_test_headers OBJECT ${CMAKE_BINARY_DIR}/test_headers.cpp)
  target_link_libraries(axlecast_test_headers PRIVATE axlecast_flags GTest::gmock axlecast_test_flags)
  target_precompile_headers(axlecast_test_headers PRIVATE <gmock/gmock.h> <gtest/gtest.h> <fstream> <functional> <map> <optional>
    <span> <variant> <nlohmann/json.hpp> <tl/expected.hpp> <yaml-cpp/yaml.h>)
endif()

# axlecast_library_headers(TARGET): with AXLECAST_UNITY, compiles the standard library and nlohmann/json once for all libraries
# of this folder and below: they are a quarter of the time of a library's file. `tools/campaign tidy` compiles each
# file alone without them, so that a missing include is still found.
macro(axlecast_library_headers target)
  if(AXLECAST_UNITY)
    file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/library_headers.cpp CONTENT "")
    add_library(${target} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/library_headers.cpp)
    target_link_libraries(${target} PRIVATE axlecast_flags)
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <chrono> <cmath> <fstream> <functional> <map> <memory>
      <optional> <set> <span> <string> <string_view> <unordered_map> <utility> <variant> <vector> <nlohmann/json.hpp>
      <tl/expected.hpp>)
    set(axlecast_precompiled ${target})
  endif()
endmacro()
axlecast_library_headers(axlecast_headers)

# axlecast_unity(TARGET file...): with AXLECAST_UNITY, compiles the target's files in groups.
function(axlecast_unity target)
  list(LENGTH ARGN count)
  if(NOT AXLECAST_UNITY OR count LESS 2)
    return()
  endif()
  execute_process(COMMAND ${Python3_EXECUTABLE} ${CMAKE_SOURCE_DIR}/cmake/unity_groups.py ${ARGN}
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} OUTPUT_VARIABLE groups OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "\n" ";" groups "${groups}")
  foreach(file group IN ZIP_LISTS ARGN groups)
    set_source_files_properties(${file} PROPERTIES UNITY_GROUP ${target}_${group})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# axlecast_test_program(TARGET SOURCES file... LIBRARIES target...)
#
# A GoogleTest program that ctest does not know.
function(axlecast_test_program target)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${target} ${ARG_SOURCES})
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  target_link_libraries(${target} PRIVATE ${ARG_LIBRARIES} GTest::gmock GTest::gtest_main axlecast_test_flags)
  target_precompile_headers(${target} REUSE_FROM axlecast_test_headers)
  axlecast_unity(${target} ${ARG_SOURCES})
  add_dependencies(axlecast_unit_tests ${target})
  if(NOT AXLECAST_UNIT_TESTS)
    set_target_properties(${target} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()

# axlecast_unit_test(NAME TARGET [SHARDS n])
#
# Adds the GoogleTest program TARGET to ctest as one entry NAME, or as n entries NAME.1 to NAME.n that share its cases. One
# process for each case would take most of its time to start under the address sanitizer. Each entry writes its results to
# results/NAME.json, which tests/support/count_cases.py adds up.
function(axlecast_unit_test name target)
  cmake_parse_arguments(ARG "" "SHARDS" "" ${ARGN})
  if(NOT ARG_SHARDS)
    set(ARG_SHARDS 1)
  endif()
  foreach(shard RANGE 1 ${ARG_SHARDS})
    set(entry ${name})
    if(ARG_SHARDS GREATER 1)
      set(entry ${name}.${shard})
    endif()
    math(EXPR index "${shard} - 1")
    add_test(NAME ${entry} COMMAND ${target} --gtest_brief=1 --gtest_output=json:${CMAKE_BINARY_DIR}/results/${entry}.json)
    set_tests_properties(${entry} PROPERTIES LABELS unit TIMEOUT 1200
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${index}")
  endforeach()
endfunction()

# axlecast_test(TARGET NAME [SHARDS n] SOURCES file... LIBRARIES target...)
#
# A GoogleTest program that ctest knows as NAME.
function(axlecast_test target name)
  cmake_parse_arguments(ARG "" "SHARDS" "SOURCES;LIBRARIES" ${ARGN})
  axlecast_test_program(${target} SOURCES ${ARG_SOURCES} LIBRARIES ${ARG_LIBRARIES})
  if(AXLECAST_UNIT_TESTS)
    axlecast_unit_test(${name} ${target} SHARDS ${ARG_SHARDS})
  endif()
endfunction()

# axlecast_folder(TARGET [DEPENDS target...] [EXCEPT file.cpp...])
#
# The convention of every folder: its .cpp files are the library TARGET, its *_test.cpp files are the tests of
# TARGET_test, its *_fuzz.cpp files are one libFuzzer program each, and main.cpp is for the folder's own
# CMakeLists.txt to name, as are the files that EXCEPT names. A program that uses nothing of a file that ALONE names does
# not link it either.
function(axlecast_folder target)
  cmake_parse_arguments(ARG "" "" "DEPENDS;TEST_DEPENDS;EXCEPT;ALONE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cpp)
  if(AXLECAST_SANITIZE MATCHES thread)
    # They replace operator new, as the thread sanitizer's runtime does.
    list(FILTER tests EXCLUDE REGEX "/allocation_test\\.cpp$")
  endif()
  file(GLOB fuzzers CONFIGURE_DEPENDS *_fuzz.cpp)
  if(sources)
    list(FILTER sources EXCLUDE REGEX "_(test|fuzz)\\.cpp$|/main\\.cpp$")
  endif()
  foreach(file ${ARG_EXCEPT})
    list(REMOVE_ITEM sources ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    list(REMOVE_ITEM tests ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  endforeach()
  if(sources)
    add_library(${target} STATIC ${sources})
    if(ARG_ALONE)
      set_source_files_properties(${ARG_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
    axlecast_unity(${target} ${sources})
    target_link_libraries(${target} PUBLIC axlecast_flags ${ARG_DEPENDS})
    if(AXLECAST_UNITY)
      target_precompile_headers(${target} REUSE_FROM ${axlecast_precompiled})
    endif()
  else()
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE axlecast_flags ${ARG_DEPENDS})
  endif()
  if(tests AND AXLECAST_TESTS)
    axlecast_test(${target}_test ${target} SOURCES ${tests} LIBRARIES ${target} ${ARG_TEST_DEPENDS})
  endif()
  axlecast_check_product_code(${target})
  file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  list(JOIN ARG_DEPENDS "," depends)
  set_property(GLOBAL APPEND PROPERTY AXLECAST_ROOMS "${folder} ${target} ${depends}")
  if(AXLECAST_FUZZERS)
    foreach(fuzzer ${fuzzers})
      get_filename_component(name ${fuzzer} NAME_WE)
      add_executable(${target}_${name} ${fuzzer})
      target_link_libraries(${target}_${name} PRIVATE ${target} ${ARG_TEST_DEPENDS})
      target_link_options(${target}_${name} PRIVATE -fsanitize=fuzzer)
      if(AXLECAST_UNITY)
        target_precompile_headers(${target}_${name} REUSE_FROM ${axlecast_precompiled})
      endif()
      set_target_properties(${target}_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz)
      add_dependencies(axlecast_fuzzers ${target}_${name})
    endforeach()
  endif()
endfunction()

# axlecast_write_rooms(FILE): the folders, their libraries and what these depend on, one a line, for tests/docs/rooms.py.
function(axlecast_write_rooms file)
  get_property(rooms GLOBAL PROPERTY AXLECAST_ROOMS)
  list(JOIN rooms "\n" text)
  file(CONFIGURE OUTPUT ${file} CONTENT "${text}\n")
endfunction()

# axlecast_family(NAME [DEPENDS target...])
#
# One family of devices in drivers/NAME: library family_NAME, which defines `const Family& NAME_family()` in
# namespace axlecast, and the driver program axlecast-<name>. Named by the folder; nothing else lists it.
function(axlecast_family name)
  cmake_parse_arguments(ARG "" "" "DEPENDS" ${ARGN})
  axlecast_folder(family_${name} DEPENDS core_device core_messages core_config lcmtypes nlohmann_json::nlohmann_json ${ARG_DEPENDS}
    TEST_DEPENDS tests_support)
  set_property(GLOBAL APPEND PROPERTY AXLECAST_FAMILIES ${name})
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/probe.cpp)
    set_property(GLOBAL APPEND PROPERTY AXLECAST_PROBES ${name})
  endif()
  string(REPLACE _ - program ${name})
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/main.cpp
    "#include \"drivers/runtime/process/driver_main.h\"\n\n"
    "namespace axlecast {\nconst Family& ${name}_family();\n}\n\n"
    "int main(int argc, char** argv) { return axlecast::DriverMain(axlecast::${name}_family(), argc, argv); }\n")
  add_executable(axlecast-${program} ${CMAKE_CURRENT_BINARY_DIR}/main.cpp)
  target_link_libraries(axlecast-${program} PRIVATE family_${name} runtime_process single_family_${name})
  add_dependencies(axlecast_programs axlecast-${program})
  # In a driver the table of families holds its own.
  axlecast_family_table(single_family_${name} ${name})
endfunction()

# axlecast_family_table(TARGET NAME...): defines Families() for a program that links these families.
function(axlecast_family_table target)
  set(declarations "")
  set(entries "")
  foreach(name ${ARGN})
    string(APPEND declarations "const Family& ${name}_family();\n")
    string(APPEND entries "&${name}_family(), ")
    list(APPEND libraries family_${name})
  endforeach()
  list(LENGTH ARGN count)
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp @ONLY CONTENT
"#include <array>

#include \"core/device/family.h\"

namespace axlecast {
@declarations@
std::span<const Family* const> Families() {
  static const std::array<const Family*, @count@> families = {@entries@};
  return families;
}

}  // namespace axlecast
")
  add_library(${target} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp)
  target_link_libraries(${target} PUBLIC axlecast_flags ${libraries})
  target_sources(${target} INTERFACE $<TARGET_OBJECTS:${target}>)
endfunction()

# axlecast_probe_table(TARGET NAME...): defines FamilyProbes() for a program that looks for devices of these families.
function(axlecast_probe_table target)
  set(declarations "")
  set(entries "")
  foreach(name ${ARGN})
    string(APPEND declarations
      "const Family& ${name}_family();\nstd::vector<ProbeTrial> ${name}_probe(const ProbeScope& scope);\n")
    string(APPEND entries "{&${name}_family(), &${name}_probe}, ")
    list(APPEND libraries family_${name})
  endforeach()
  list(LENGTH ARGN count)
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp @ONLY CONTENT
"#include <array>

#include \"core/device/probe.h\"

namespace axlecast {
@declarations@
std::span<const FamilyProbe> FamilyProbes() {
  static const std::array<FamilyProbe, @count@> probes = {{@entries@}};
  return probes;
}

}  // namespace axlecast
")
  add_library(${target} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp)
  target_link_libraries(${target} PUBLIC axlecast_flags ${libraries})
  target_sources(${target} INTERFACE $<TARGET_OBJECTS:${target}>)
endfunction()
