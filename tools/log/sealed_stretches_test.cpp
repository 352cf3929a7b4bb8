#include "tools/log/sealed_stretches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "tools/log/log_fixture.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Kind = LogStretch::Kind;

// A log as the recorder writes it: stretches of `events` events, each with its seal.
class SealedLog {
 public:
  SealedLog& Add(int events, std::size_t size = 30) {
    for (int i = 0; i < events; ++i) AddEvent("AXIS", std::string(size, static_cast<char>('a' + i % 26)));
    return *this;
  }
  SealedLog& AddEvent(const std::string& channel, const std::string& data) {
    offsets.push_back(bytes.size());
    const Bytes record =
        encoder_.Add({.number = 0, .utime = utime_ += 1'000, .channel = channel, .data = AsBytes(data)});
    bytes.insert(bytes.end(), record.begin(), record.end());
    return *this;
  }
  SealedLog& Seal() {
    offsets.push_back(bytes.size());
    const Bytes record = encoder_.Seal(utime_);
    bytes.insert(bytes.end(), record.begin(), record.end());
    return *this;
  }
  void Remove(std::size_t first, std::size_t last) {
    bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(offsets[first]),
                bytes.begin() + static_cast<std::ptrdiff_t>(offsets[last]));
  }

  std::vector<std::uint8_t> bytes;
  std::vector<std::size_t> offsets;  // of the records

 private:
  LogEncoder encoder_;
  std::int64_t utime_ = ScriptedLog::kStart;
};

std::vector<std::int64_t> Numbers(Bytes records) {
  std::vector<std::int64_t> numbers;
  LogReader reader(records);
  for (auto event = reader.Next(); event; event = reader.Next()) numbers.push_back(event->number);
  return numbers;
}

struct Read {
  std::vector<Kind> kinds;
  std::vector<std::int64_t> numbers;  // of all records
  std::int64_t skipped = 0;
  LogPlace end;
};

Read ReadStretches(Bytes log, bool closed, LogPlace place = {}) {
  Read read;
  for (LogStretch stretch = NextStretch(log, place, closed); stretch.kind != Kind::kIncomplete;
       stretch = NextStretch(log, place, closed)) {
    read.kinds.push_back(stretch.kind);
    for (const std::int64_t number : Numbers(stretch.records)) read.numbers.push_back(number);
    read.skipped += std::max<std::int64_t>(0, stretch.messages);
    place = stretch.next;
  }
  read.end = place;
  return read;
}

TEST(NextStretch, ReturnsWhatASealVerifies) {
  SealedLog log;
  log.Add(3).Seal().Add(2).Seal();
  const LogStretch first = NextStretch(log.bytes, {}, false);
  EXPECT_EQ(first.kind, Kind::kSealed);
  EXPECT_THAT(Numbers(first.records), ElementsAre(0, 1, 2));
  EXPECT_EQ(first.seal.events, 3U);
  EXPECT_EQ(first.next, (LogPlace{4, log.offsets[4]}));
  const LogStretch second = NextStretch(log.bytes, first.next, false);
  EXPECT_THAT(Numbers(second.records), ElementsAre(4, 5));
  EXPECT_EQ(NextStretch(log.bytes, second.next, true).kind, Kind::kIncomplete);
}

TEST(NextStretch, WaitsForTheSealOfALogThatGrows) {
  SealedLog log;
  log.Add(3).Seal().Add(2).Seal();
  const LogPlace place = NextStretch(log.bytes, {}, false).next;
  for (std::size_t size = place.offset; size < log.bytes.size(); ++size) {
    EXPECT_EQ(NextStretch(Bytes(log.bytes).first(size), place, false).kind, Kind::kIncomplete) << size;
  }
  EXPECT_EQ(NextStretch({}, {}, true).kind, Kind::kIncomplete);
}

TEST(NextStretch, ReturnsTheUnsealedEndOfAClosedLog) {
  SealedLog log;
  log.Add(3).Seal().Add(2);
  const std::size_t whole = log.bytes.size();
  log.Add(1);
  const Bytes torn = Bytes(log.bytes).first(whole + 40);
  const Read read = ReadStretches(torn, true);
  EXPECT_THAT(read.kinds, ElementsAre(Kind::kSealed, Kind::kUnsealed, Kind::kDamaged));
  EXPECT_THAT(read.numbers, ElementsAre(0, 1, 2, 4, 5));
  EXPECT_EQ(read.end, (LogPlace{7, torn.size()}));
}

TEST(NextStretch, ReturnsTheEndInPieces) {
  SealedLog log;
  log.Add(5, 600'000);
  const Read read = ReadStretches(log.bytes, true);
  EXPECT_EQ(read.kinds.size(), 5U);
  EXPECT_THAT(read.numbers, ElementsAre(0, 1, 2, 3, 4));
}

TEST(NextStretch, ContinuesInsideAStretch) {
  SealedLog log;
  log.Add(5).Seal().Add(1).Seal();
  // The first two events were returned as the end of a log that was not closed after all.
  const Read read = ReadStretches(log.bytes, false, {2, log.offsets[2]});
  EXPECT_THAT(read.kinds, ElementsAre(Kind::kSealed, Kind::kSealed));
  EXPECT_THAT(read.numbers, ElementsAre(2, 3, 4, 6));
  // And all events before the seal.
  EXPECT_THAT(ReadStretches(log.bytes, false, {5, log.offsets[5]}).numbers, ElementsAre(5, 6));
}

TEST(NextStretch, SkipsAStretchThatItsSealDoesNotVerify) {
  SealedLog log;
  log.Add(3).Seal().Add(3).Seal().Add(2).Seal();
  log.bytes[log.offsets[5] + 40] ^= 1U;
  const Read read = ReadStretches(log.bytes, false);
  EXPECT_THAT(read.kinds, ElementsAre(Kind::kSealed, Kind::kDamaged, Kind::kSealed));
  EXPECT_THAT(read.numbers, ElementsAre(0, 1, 2, 8, 9));
  EXPECT_EQ(read.skipped, 3);
}

TEST(NextStretch, SkipsOnlyTheStretchWhoseSealIsDamaged) {
  SealedLog log;
  log.Add(3).Seal().Add(3).Seal();
  log.bytes[log.offsets[3]] ^= 1U;  // no longer a record
  const Read read = ReadStretches(log.bytes, false);
  EXPECT_THAT(read.kinds, ElementsAre(Kind::kDamaged, Kind::kSealed));
  EXPECT_THAT(read.numbers, ElementsAre(4, 5, 6));
}

TEST(NextStretch, ReportsWhatARepairRemoved) {
  SealedLog log;
  log.Add(3).Seal().Add(3).Seal().Add(2).Seal();
  log.Remove(4, 8);
  const Read read = ReadStretches(log.bytes, true);
  EXPECT_THAT(read.kinds, ElementsAre(Kind::kSealed, Kind::kDamaged, Kind::kSealed));
  EXPECT_THAT(read.numbers, ElementsAre(0, 1, 2, 8, 9));
}

TEST(NextStretch, IsNotDeceivedByAMessageOnTheChannelOfTheSeals) {
  SealedLog log;
  log.Add(2)
      .AddEvent(std::string(kSealChannel), std::string(20, 'x'))
      .AddEvent(std::string(kSealChannel), "y")
      .Add(2)
      .Seal();
  const Read read = ReadStretches(log.bytes, false);
  EXPECT_THAT(read.kinds, ElementsAre(Kind::kSealed));
  EXPECT_THAT(read.numbers, ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST(NextStretch, SkipsDamageAtTheEndOfAClosedLog) {
  SealedLog log;
  log.Add(3).Seal();
  log.bytes[log.offsets[1] + 40] ^= 1U;
  log.Add(2);
  EXPECT_THAT(ReadStretches(log.bytes, false).kinds, IsEmpty());
  const Read read = ReadStretches(log.bytes, true);
  EXPECT_THAT(read.kinds, ElementsAre(Kind::kDamaged, Kind::kUnsealed));
  EXPECT_THAT(read.numbers, ElementsAre(4, 5));
  EXPECT_EQ(read.skipped, 3);
}

TEST(NextStretch, ReturnsEachEventAtMostOnceWhateverIsDamaged) {
  std::mt19937 random(21);
  for (int round = 0; round < 300; ++round) {
    SealedLog log;
    for (int i = 0; i < 12; ++i) log.Add(4).Seal();
    std::vector<bool> damaged(log.offsets.size());
    for (int hit = 0; hit < 1 + round % 8; ++hit) {
      const std::size_t offset = random() % log.bytes.size();
      log.bytes[offset] = static_cast<std::uint8_t>(random());
      const auto record = std::ranges::upper_bound(log.offsets, offset) - log.offsets.begin() - 1;
      damaged[static_cast<std::size_t>(record)] = true;
    }
    const Read read = ReadStretches(log.bytes, true);
    EXPECT_TRUE(std::ranges::is_sorted(read.numbers, std::ranges::less_equal{}) || read.numbers.size() < 2);
    // A stretch without damage, with its seal and that of the stretch before, is returned.
    for (std::size_t stretch = 0; stretch < 12; ++stretch) {
      const auto begin = damaged.begin() + static_cast<std::ptrdiff_t>(stretch * 5);
      if (std::count(begin, begin + 5, true) > 0) continue;
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(std::ranges::count(read.numbers, static_cast<std::int64_t>(stretch * 5 + i)), 1)
            << round << ' ' << ::testing::PrintToString(read.numbers) << ::testing::PrintToString(damaged);
      }
    }
  }
}

TEST(FindPlace, TrustsAHintBehindTheRightSeal) {
  SealedLog log;
  log.Add(3).Seal().Add(3).Seal();
  EXPECT_EQ(FindPlace(log.bytes, 4, log.offsets[4]), (LogPlace{4, log.offsets[4]}));
  EXPECT_EQ(FindPlace(log.bytes, 8, log.bytes.size()), (LogPlace{8, log.bytes.size()}));
  EXPECT_EQ(FindPlace(log.bytes, 0, 99), (LogPlace{0, 0}));
}

TEST(FindPlace, FindsTheNumberInARepairedLog) {
  SealedLog log;
  log.Add(3).Seal().Add(3).Seal().Add(3).Seal();
  const std::size_t hint = log.offsets[8];
  log.Remove(1, 3);
  const LogPlace place = FindPlace(log.bytes, 8, hint);
  EXPECT_EQ(place.number, 8);
  EXPECT_THAT(ReadStretches(log.bytes, true, place).numbers, ElementsAre(8, 9, 10));
}

TEST(FindPlace, FindsAPlaceInsideAStretch) {
  SealedLog log;
  log.Add(5).Seal();
  EXPECT_EQ(FindPlace(log.bytes, 3, 7), (LogPlace{3, log.offsets[3]}));
}

TEST(FindPlace, IsTheEndOfALogThatIsShorterThanItWas) {
  SealedLog log;
  log.Add(3).Seal();
  EXPECT_EQ(FindPlace(log.bytes, 40, 12), (LogPlace{40, log.bytes.size()}));
}

}  // namespace
}  // namespace axlecast
