// What each function of a family's library calls in programs that do not judge their tests: cmake/product_code.cmake.
extern "C" __attribute__((no_instrument_function, no_sanitize("address", "undefined"))) void
__cyg_profile_func_enter_bare() {}
