// Fails every test of this program that runs no product code: cmake/product_code.cmake.
#include <gtest/gtest.h>

#include <atomic>

namespace {

std::atomic<bool> product_code_ran = false;

class ProductCodeCheck final : public ::testing::EmptyTestEventListener {
 public:
  void OnTestStart(const ::testing::TestInfo&) override { product_code_ran = false; }

  // A skipped test proves nothing, and does not pretend to.
  void OnTestEnd(const ::testing::TestInfo& test) override {
    if (product_code_ran || test.result()->Skipped()) return;
    ADD_FAILURE_AT(test.file(), test.line())
        << "This test runs no product code of its family: it cannot fail when the product is wrong. Call the "
           "function that its name is about, or remove the test.";
  }
};

// GoogleTest's own main knows no listener but the printer's: this one is added before it begins.
[[maybe_unused]] const bool added = [] {
  ::testing::UnitTest::GetInstance()->listeners().Append(new ProductCodeCheck);
  return true;
}();

}  // namespace

// What each function of the family's libraries calls first.
extern "C" __attribute__((no_sanitize("address", "undefined"))) void __cyg_profile_func_enter_bare() {
  product_code_ran.store(true, std::memory_order_relaxed);
}
