# Hardening of programs that a user may install, of every build type; tests/package/test_hardening.py reads it from them.
target_compile_options(axlecast_flags INTERFACE -fPIE -fstack-protector-strong -fstack-clash-protection)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64|i.86")
  target_compile_options(axlecast_flags INTERFACE -fcf-protection=full)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  target_compile_options(axlecast_flags INTERFACE -mbranch-protection=standard)
endif()
# Only with optimisation, which CMake's own Debug type has not. First undefined: Debian's compilers may define it too.
target_compile_options(axlecast_flags INTERFACE
  $<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
# Packages are the same bytes wherever they are compiled. Tests find their files by __FILE__, which stays.
target_compile_options(axlecast_flags INTERFACE -fdebug-prefix-map=${CMAKE_SOURCE_DIR}=axlecast
  -fdebug-prefix-map=${CMAKE_BINARY_DIR}=build)
target_link_options(axlecast_flags INTERFACE -pie -Wl,-z,relro,-z,now,-z,noexecstack)
