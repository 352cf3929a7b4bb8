#include "tools/fleet/read/recorded_log.h"

#include <gmock/gmock.h>

#include <string>

#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

constexpr std::int64_t kUtime = 1'795'244'405'000'000;

// A log as the recorder writes it: three header events, and a seal behind every `stretch` messages.
struct Recorded {
  std::vector<std::uint8_t> log;
  std::vector<std::vector<LogEvent>> stretches;  // of messages, with their numbers
  std::vector<std::string> texts;
};

Recorded MakeLog(int messages, int stretch) {
  Recorded made;
  LogEncoder encoder;
  std::int64_t number = 0;
  const auto write = [&](Bytes record) {
    made.log.insert(made.log.end(), record.begin(), record.end());
    ++number;
  };
  for (const std::string_view channel : {kRecorderChannel, kMachineChannel, kSchemaChannel}) {
    write(encoder.Add({.number = 0, .utime = kUtime, .channel = channel, .data = AsBytes("head")}));
  }
  made.texts.reserve(static_cast<std::size_t>(messages));
  std::int64_t utime = kUtime;
  for (int i = 0; i < messages; ++i) {
    if (i % stretch == 0) {
      if (i > 0) write(encoder.Seal(utime));
      made.stretches.emplace_back();
    }
    utime += 1'000;
    const std::string& text = made.texts.emplace_back("message " + std::to_string(i));
    made.stretches.back().push_back(
        {.number = number, .utime = utime, .channel = "POSITION/a", .data = AsBytes(text)});
    write(encoder.Add(made.stretches.back().back()));
  }
  write(encoder.Seal(utime));
  return made;
}

std::vector<std::uint8_t> Restored(const Recorded& recorded) {
  std::vector<std::uint8_t> log;
  RecordedLogEncoder encoder([&](Bytes record) {
    log.insert(log.end(), record.begin(), record.end());
    return true;
  });
  for (const std::string_view channel : {kRecorderChannel, kMachineChannel, kSchemaChannel}) {
    encoder.AddHeader(kUtime, channel, "head");
  }
  for (const auto& stretch : recorded.stretches) {
    for (const LogEvent& event : stretch) encoder.Add(event);
  }
  EXPECT_TRUE(encoder.End());
  return log;
}

TEST(RecordedLog, IsTheRecordedLogByteForByte) {
  for (const int stretch : {1, 2, 7, 100}) {
    const Recorded recorded = MakeLog(100, stretch);
    EXPECT_EQ(Restored(recorded), recorded.log) << stretch;
  }
}

TEST(RecordedLog, StopsWhenTheDiskIsFull) {
  const Recorded recorded = MakeLog(10, 5);
  int writes = 0;
  RecordedLogEncoder encoder([&](Bytes) { return ++writes < 3; });
  for (const LogEvent& event : recorded.stretches.front()) encoder.Add(event);
  EXPECT_FALSE(encoder.good());
  EXPECT_FALSE(encoder.End());
  EXPECT_EQ(writes, 3);
}

RawCoverage CoverageOf(const Recorded& recorded, std::size_t without = SIZE_MAX) {
  RawCoverage coverage;
  for (std::size_t i = 0; i < recorded.stretches.size(); ++i) {
    if (i == without) continue;
    coverage.Add(recorded.stretches[i].front().number, static_cast<std::int64_t>(recorded.stretches[i].size()));
  }
  return coverage;
}

TEST(RawCoverage, IsWholeWithHeaderAndSealsMissing) {
  const Recorded recorded = MakeLog(100, 10);
  LogReader reader(recorded.log);
  std::int64_t upto = 0;
  for (auto event = reader.Next(); event; event = reader.Next()) upto = event->number + 1;
  EXPECT_TRUE(CoverageOf(recorded).IsWhole(upto));
  EXPECT_EQ(CoverageOf(recorded).records(), 100);
  EXPECT_FALSE(CoverageOf(recorded).IsWhole(upto + 1)) << "a message at the end";
  EXPECT_FALSE(CoverageOf(recorded).IsWhole(upto - 2)) << "more than the ledger has";
  for (std::size_t i = 0; i < recorded.stretches.size(); ++i)
    EXPECT_FALSE(CoverageOf(recorded, i).IsWhole(upto)) << i;
}

TEST(RawCoverage, IsNotWholeIfSomeChannelsAreNotRaw) {
  RawCoverage coverage;
  coverage.Add(3, 5);   // of the events 3 to 12
  coverage.Add(14, 5);  // 13 is the seal
  EXPECT_FALSE(coverage.IsWhole(20));
}

TEST(RawCoverage, IsNotWholeWithoutRows) { EXPECT_FALSE(RawCoverage().IsWhole(4)); }

}  // namespace
}  // namespace axlecast
