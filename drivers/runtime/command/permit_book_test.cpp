#include "drivers/runtime/command/permit_book.h"

#include <gtest/gtest.h>

#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>

#include "drivers/runtime/command/order_test_support.h"

namespace axlecast {
namespace {

permit_body_t PermitFor(const std::string& device, std::int64_t issue, std::int32_t valid_ms) {
  permit_body_t body{};
  body.device = device;
  body.issuer_boot_id = 3;
  body.issue = issue;
  body.valid_ms = valid_ms;
  body.operations = {"bump"};
  body.n_operations = 1;
  return body;
}

std::vector<std::uint8_t> Enveloped(const permit_body_t& body) {
  permit_t envelope{};
  envelope.permit = Encoded(body);
  envelope.permit_size = static_cast<std::int16_t>(envelope.permit.size());
  return Encoded(envelope);
}

TEST(PermitBook, HoldsForItsTimeAndItsOperations) {
  PermitBook book(CountingBus("b0", {"axis1", "axis2"}));
  EXPECT_FALSE(book.Holds("axis1", "bump", 0));
  book.Accept("axis1", Enveloped(PermitFor("axis1", 1, 500)), kSecond);
  EXPECT_TRUE(book.Holds("axis1", "bump", kSecond + 500 * kMillisecond - 1));
  EXPECT_FALSE(book.Holds("axis1", "bump", kSecond + 500 * kMillisecond));
  EXPECT_FALSE(book.Holds("axis1", "write", kSecond));
  EXPECT_FALSE(book.Holds("axis2", "bump", kSecond));
}

TEST(PermitBook, IgnoresWhatIsMalformedForeignOrOvertaken) {
  PermitBook book(CountingBus("b0", {"axis1", "axis2"}));
  book.Accept("axis1", Enveloped(PermitFor("axis1", 1, 501)), 0);
  book.Accept("axis1", Enveloped(PermitFor("axis1", 1, 0)), 0);
  book.Accept("axis1", Enveloped(PermitFor("axis2", 1, 500)), 0);
  book.Accept("axis9", Enveloped(PermitFor("axis9", 1, 500)), 0);
  book.Accept("axis1", {}, 0);
  EXPECT_FALSE(book.Holds("axis1", "bump", 1));

  book.Accept("axis1", Enveloped(PermitFor("axis1", 5, 100)), 0);
  book.Accept("axis1", Enveloped(PermitFor("axis1", 5, 500)), 90 * kMillisecond);  // replayed
  EXPECT_FALSE(book.Holds("axis1", "bump", 100 * kMillisecond));
  book.Accept("axis1", Enveloped(PermitFor("axis1", 6, 100)), 90 * kMillisecond);
  EXPECT_TRUE(book.Holds("axis1", "bump", 100 * kMillisecond));
}

TEST(PermitBook, NotRequiredIsAlwaysHeld) {
  BusConfig bus = CountingBus("b0", {"axis1"});
  bus.devices[0].permit_required = false;
  const PermitBook book(bus);
  EXPECT_TRUE(book.Holds("axis1", "bump", 0));
}

}  // namespace
}  // namespace axlecast
