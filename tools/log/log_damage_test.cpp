// Every undamaged event of a damaged log is found, and no other event. All other bytes are reported as damage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <string>

#include "tests/support/thorough.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using Damaged = std::set<std::size_t>;  // offsets of bytes

// Whether record `i` is all there, and no byte of it damaged.
bool IsWhole(const ScriptedLog& log, std::size_t i, const Damaged& damaged, std::size_t size) {
  const auto hit = damaged.lower_bound(log.offsets()[i]);
  return log.end(i) <= size && (hit == damaged.end() || *hit >= log.end(i));
}

std::vector<std::size_t> Whole(const ScriptedLog& log, std::size_t size) {
  std::vector<std::size_t> whole;
  for (std::size_t i = 0; i < log.offsets().size(); ++i) {
    if (IsWhole(log, i, {}, size)) whole.push_back(log.offsets()[i]);
  }
  return whole;
}

// Empty, or what is wrong with how the reader reads `bytes`.
std::string Problem(const ScriptedLog& log, const std::vector<std::uint8_t>& bytes, const Damaged& damaged) {
  const ReadLog read = ReadAll(bytes);
  if (read.covered != bytes.size()) return "events and damage are not the whole log";
  for (std::size_t i = 0; i < log.offsets().size(); ++i) {
    if (!IsWhole(log, i, damaged, bytes.size())) continue;
    const auto found = std::ranges::lower_bound(read.offsets, log.offsets()[i]);
    if (found == read.offsets.end() || *found != log.offsets()[i]) return "lost event " + std::to_string(i);
    if (std::next(found) != read.offsets.end() && *std::next(found) < log.end(i)) {
      return "took event " + std::to_string(i) + " apart";
    }
  }
  return "";
}

std::string Where(const Damaged& damaged) {
  std::string text = " damaged:";
  for (const std::size_t offset : damaged) text += ' ' + std::to_string(offset);
  return text;
}

ScriptedLog EqualSizes() {
  ScriptedLog log;
  for (int i = 0; i < 8; ++i) log.Add("AXIS", std::string(32, static_cast<char>('a' + i)));  // 64 bytes each
  return log;
}

// Of another recorder, a day before.
ScriptedLog OtherLog() {
  ScriptedLog other(40, ScriptedLog::kStart - 86'400'000'000);
  for (int i = 0; i < 3; ++i) other.Add("OTHER", "0123456789");
  return other;
}

// Data with the sync word, whole records and a whole log, and the beginning of one.
ScriptedLog WithLogsInside() {
  const ScriptedLog other = OtherLog();
  const Bytes inside = other.bytes();
  const std::string sync = "\xED\xA1\xDA\x01";
  ScriptedLog log;
  log.Add("PLAIN", "first").Add("SYNC", sync + sync + "x" + sync).Add("EMPTY", "").Add("LOG", inside);
  log.Add("PLAIN", "between").Add("RECORD", inside.first(other.end(0))).Add("TORN", inside.first(other.end(1) - 3));
  log.Add("PLAIN", "again").Add("LOG", inside).Add("SYNC", sync).Add("LAST", "the end");
  return log;
}

// As a stock tool leaves it that filters and keeps the numbers.
ScriptedLog WithGapsInItsNumbers() {
  ScriptedLog log(1'000);
  std::int64_t number = 1'000;
  for (int i = 0; i < 9; ++i) {
    const std::string data(static_cast<std::size_t>(10 + 7 * i), 'x');
    log.AddNumbered(number, "GAPS", Bytes(reinterpret_cast<const std::uint8_t*>(data.data()), data.size()));
    number += 3 + 40 * (i % 3);
  }
  return log;
}

// Two logs, one behind the other.
ScriptedLog Concatenated() {
  ScriptedLog log(100);
  for (int i = 0; i < 6; ++i) log.Add("FIRST", "one");
  log.AddNumbered(0, "SECOND", {});
  for (int i = 0; i < 9; ++i) log.Add("SECOND", "two");
  return log;
}

class DamagedLog : public testing::TestWithParam<ScriptedLog (*)()> {};

INSTANTIATE_TEST_SUITE_P(Logs, DamagedLog,
                         testing::Values(EqualSizes, WithLogsInside, WithGapsInItsNumbers, Concatenated));

TEST_P(DamagedLog, UndamagedIsReadWhole) {
  const ScriptedLog log = GetParam()();
  const ReadLog read = ReadAll(log.bytes());
  EXPECT_EQ(read.offsets, log.offsets());
  EXPECT_TRUE(read.damage.empty());
}

TEST_P(DamagedLog, CutAtEveryByteLosesTheCutRecordOnly) {
  const ScriptedLog log = GetParam()();
  for (std::size_t size = 0; size <= log.bytes().size(); ++size) {
    const std::vector<std::uint8_t> bytes(log.bytes().begin(),
                                          log.bytes().begin() + static_cast<std::ptrdiff_t>(size));
    const ReadLog read = ReadAll(bytes);
    EXPECT_EQ(read.offsets, Whole(log, size)) << size;
    const std::size_t whole = read.offsets.empty() ? 0 : log.end(read.offsets.size() - 1);
    if (whole == size) {
      EXPECT_TRUE(read.damage.empty()) << size;
    } else {
      EXPECT_THAT(read.damage, testing::ElementsAre(LogReader::Damage{whole, size - whole})) << size;
    }
  }
}

TEST_P(DamagedLog, AnyOtherValueOfAnyByteCostsItsEventOnly) {
  const ScriptedLog log = GetParam()();
  std::vector<std::uint8_t> bytes = log.bytes();
  constexpr unsigned kStep = StepOfValues(11U);
  for (std::size_t offset = 0; offset < bytes.size(); ++offset) {
    for (unsigned change = 1 + static_cast<unsigned>(offset) % kStep; change < 256; change += kStep) {
      bytes[offset] = static_cast<std::uint8_t>(log.bytes()[offset] ^ change);
      ASSERT_EQ(Problem(log, bytes, {offset}), "") << offset << " changed by " << change;
    }
    bytes[offset] = log.bytes()[offset];
  }
}

// Every length that a record's data length can be damaged to, within the log and a little beyond.
TEST_P(DamagedLog, AnyLengthCostsItsEventOnly) {
  const ScriptedLog log = GetParam()();
  for (const std::size_t record : log.offsets()) {
    const Damaged damaged = {record + 24, record + 25, record + 26, record + 27};
    for (std::size_t length = 0; length < log.bytes().size() + 50; ++length) {
      std::vector<std::uint8_t> bytes = log.bytes();
      bytes[record + 24] = 0;
      bytes[record + 25] = static_cast<std::uint8_t>(length >> 16U);
      bytes[record + 26] = static_cast<std::uint8_t>(length >> 8U);
      bytes[record + 27] = static_cast<std::uint8_t>(length);
      ASSERT_EQ(Problem(log, bytes, damaged), "") << record << " length " << length;
    }
  }
}

TEST_P(DamagedLog, BytesPutInCostNoEvent) {
  const ScriptedLog log = GetParam()();
  for (const std::size_t record : log.offsets()) {
    for (const std::size_t size : {1U, 10U, 100U}) {
      std::vector<std::uint8_t> bytes = log.bytes();
      bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(record), size, std::uint8_t{0xED});
      const ReadLog read = ReadAll(bytes);
      EXPECT_EQ(read.offsets.size(), log.offsets().size()) << record;
      EXPECT_THAT(read.damage, testing::ElementsAre(LogReader::Damage{record, size})) << record;
    }
  }
}

// Random logs of a thousand events, small and large, some with parts of other logs inside.
ScriptedLog Random(std::mt19937& random) {
  const ScriptedLog inside = OtherLog();
  ScriptedLog log;
  const std::size_t largest = std::size_t{8} << random() % 9;
  for (int i = 0; i < 1'000; ++i) {
    std::vector<std::uint8_t> data(random() % largest);
    for (std::uint8_t& byte : data) byte = static_cast<std::uint8_t>(random());
    if (random() % 20 == 0) data.insert(data.end(), inside.bytes().begin(), inside.bytes().end());
    log.Add("CHANNEL" + std::to_string(random() % 10), data);
  }
  return log;
}

TEST(RandomDamage, InOnePieceCostsItsEventsOnly) {
  std::mt19937 random(7);
  for (int round = 0; round < 8; ++round) {
    const ScriptedLog log = Random(random);
    for (int hit = 0; hit < 60; ++hit) {
      const std::size_t size = std::array<std::size_t, 3>{1, 10, 100}[random() % 3];
      const std::size_t begin = random() % (log.bytes().size() - size);
      std::vector<std::uint8_t> bytes = log.bytes();
      Damaged damaged;
      for (std::size_t offset = begin; offset < begin + size; ++offset) {
        bytes[offset] ^= static_cast<std::uint8_t>(1 + random() % 255);
        damaged.insert(offset);
      }
      ASSERT_EQ(Problem(log, bytes, damaged), "") << "round " << round << Where(damaged);
    }
  }
}

TEST(RandomDamage, ScatteredCostsItsEventsOnly) {
  std::mt19937 random(8);
  for (int round = 0; round < 120; ++round) {
    const ScriptedLog log = Random(random);
    std::vector<std::uint8_t> bytes = log.bytes();
    Damaged damaged;
    for (int hit = 0; hit < 100; ++hit) {
      const std::size_t offset = random() % bytes.size();
      if (!damaged.insert(offset).second) continue;
      bytes[offset] ^= static_cast<std::uint8_t>(1 + random() % 255);
    }
    ASSERT_EQ(Problem(log, bytes, damaged), "") << "round " << round << Where(damaged);
  }
}

}  // namespace
}  // namespace axlecast
