# The program that appears as /dev/spidev in the guest: for tests/vm and, in a build without tests, for bench.
pkg_check_modules(FUSE3 REQUIRED IMPORTED_TARGET fuse3)
add_executable(cuse_spidev ${CMAKE_CURRENT_LIST_DIR}/cuse_spidev.cpp)
target_link_libraries(cuse_spidev PRIVATE hal PkgConfig::FUSE3)
set_target_properties(cuse_spidev PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/vm/bin)
