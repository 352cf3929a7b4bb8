#include "tools/log/log_tail.h"

#include <gtest/gtest.h>

#include <string>

#include "tools/log/scripted_log.h"

namespace axlecast {
namespace {

TEST(LogTail, OfAnEmptyLogIsItsBeginning) {
  const LogTail tail = FindTail({});
  EXPECT_EQ(tail.size, 0U);
  EXPECT_EQ(tail.next_number, 0);
  EXPECT_EQ(tail.open.seal(), LogSeal{});
}

TEST(LogTail, OfALogThatIsCutAnywhereIsItsLastWholeRecord) {
  ScriptedLog log;
  log.Add("A", "one").Add("B", "two").Add("A", "three");
  for (std::size_t size = 0; size <= log.bytes().size(); ++size) {
    std::size_t whole = 0;
    while (whole < 3 && log.end(whole) <= size) ++whole;
    const LogTail tail = FindTail(Bytes(log.bytes()).first(size));
    EXPECT_EQ(tail.size, whole == 0 ? 0 : log.end(whole - 1)) << size;
    EXPECT_EQ(tail.torn, size - tail.size);
    EXPECT_EQ(tail.next_number, static_cast<std::int64_t>(whole)) << size;
    EXPECT_EQ(tail.open.seal().crc32c, Crc32c(0, Bytes(log.bytes()).first(tail.size))) << size;
  }
}

TEST(LogTail, TellsWhatTheNextSealHasToCover) {
  ScriptedLog log;
  log.Add("A", "one").Add(kSealChannel, EncodeSeal({})).Add("A", "two").Add("A", "three");
  const LogTail tail = FindTail(log.bytes());
  const Bytes open = Bytes(log.bytes()).subspan(log.offsets()[2]);
  EXPECT_EQ(tail.open.seal(), (LogSeal{.bytes = open.size(), .events = 2, .crc32c = Crc32c(0, open)}));
}

TEST(LogTail, DamageBeforeTheEndIsNotItsConcern) {
  ScriptedLog log;
  log.Add("A", "one").Add("B", "two").Add("A", "three");
  std::vector<std::uint8_t> bytes = log.bytes();
  bytes[log.offsets()[1]] = 0;
  EXPECT_EQ(FindTail(bytes).size, bytes.size());
}

TEST(LogTail, OnlyTheEndIsReadWhereASealStandsThere) {
  for (const bool sealed : {true, false}) {
    ScriptedLog log;
    for (int i = 0; i < 100; ++i) log.Add("CHANNEL", "some data");
    if (sealed) log.Add(kSealChannel, EncodeSeal({}));
    log.Add("LAST", "x");
    for (const std::size_t look : {std::size_t{300}, std::size_t{1'000}, log.bytes().size()}) {
      std::vector<std::uint8_t> bytes = log.bytes();
      bytes[log.offsets()[1]] = 0;  // told apart by what is counted
      const LogTail tail = FindTail(bytes, look);
      EXPECT_EQ(tail.size, bytes.size());
      EXPECT_EQ(tail.next_number, sealed ? 102 : 101);
      EXPECT_EQ(tail.open.seal().events, sealed ? 1U : 100U);
    }
  }
}

}  // namespace
}  // namespace axlecast
