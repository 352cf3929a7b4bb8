# cmake -DSOURCE=... -DWORK=... -P uplot_test.cmake: where a build has uPlot from, and what it says without.
cmake_minimum_required(VERSION 3.25)

# Configures once: UPLOT as AXLECAST_UPLOT, with the programs of PATH. Sets `code`, `text`, and `found` (as it was printed).
function(configure uplot path)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env PATH=${path} ${CMAKE_COMMAND} -DAXLECAST_UPLOT=${uplot} -DWORK=${WORK} -DSOURCE=${SOURCE}
      -DSTEP=1 -P ${CMAKE_CURRENT_LIST_FILE}
    RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text)
  string(REGEX REPLACE "[ \n]+" " " text "${text}")
  set(code ${code} PARENT_SCOPE)
  set(text ${text} PARENT_SCOPE)
endfunction()

function(expect wanted_code wanted_text)
  if(NOT code STREQUAL wanted_code OR NOT text MATCHES "${wanted_text}")
    message(FATAL_ERROR "wanted ${wanted_code} and \"${wanted_text}\", not ${code}: ${text}")
  endif()
endfunction()

if(STEP)
  set(CMAKE_FIND_USE_CMAKE_SYSTEM_PATH FALSE)
  include(${SOURCE}/tools/web/uplot.cmake)
  axlecast_find_uplot(found ${WORK}/npm)
  message(STATUS "found=<${found}>")
  return()
endif()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/nothing ${WORK}/broken ${WORK}/other/dist)
file(WRITE ${WORK}/broken/npm "#!/bin/sh\necho 'npm error network: no route' >&2\nexit 1\n")
file(CHMOD ${WORK}/broken/npm PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
file(WRITE ${WORK}/other/dist/uPlot.esm.js "export default 1;\n")
file(WRITE ${WORK}/other/dist/uPlot.min.css "a {}\n")

configure(auto ${WORK}/nothing)
expect(0 "without curves.*npm is missing.*-DAXLECAST_UPLOT=FOLDER.*found=<>")
configure(npm ${WORK}/nothing)
expect(1 "npm is missing.*-DAXLECAST_UPLOT=FOLDER")
configure(auto "${WORK}/broken:/usr/bin:/bin")
expect(0 "without curves.*npm cannot install it: npm error network: no route.*found=<>")
configure(npm "${WORK}/broken:/usr/bin:/bin")
expect(1 "npm cannot install it: npm error network: no route")
configure(none ${WORK}/nothing)
expect(0 "built without curves.*found=<>")
configure(${WORK}/nothing ${WORK}/nothing)
expect(1 "has neither uPlot.esm.js nor dist/uPlot.esm.js")
configure(${WORK}/other ${WORK}/nothing)
expect(1 "is not that of version")
if(EXISTS ${FETCHED}/uPlot.esm.js)  # of a build that has it
  file(SHA256 ${FETCHED}/uPlot.esm.js sha256)
  file(STRINGS ${SOURCE}/tools/web/uplot.cmake known REGEX ${sha256})
  if(known)
    configure(${FETCHED} ${WORK}/nothing)
    expect(0 "found=<${FETCHED}>")
  endif()
endif()
