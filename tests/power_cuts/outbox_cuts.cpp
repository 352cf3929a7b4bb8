#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/disk/memory_folder.h"
#include "tests/power_cuts/power_cuts.h"
#include "tools/log/log_fixture.h"
#include "tools/log/log_holes.h"
#include "tools/log/log_name.h"
#include "tools/log/opened_log.h"
#include "tools/recorder/closed_logs.h"

namespace axlecast {
namespace {

constexpr std::int64_t kHour = 3'600'000'000;         // us
constexpr std::int64_t kNow = 1'795'244'405'000'000;  // 2026-11-21 07:00:05
constexpr std::int64_t kAllFull = INT64_C(1) << 60;   // no disk has as many bytes free

class OutboxCheck {
 public:
  OutboxCheck(const CutOrder& order, CutTally& tally) : order_(order), tally_(tally), random_(order.seed) {}

  void Run() {
    std::filesystem::create_directory(live_);
    for (int i = 0; i <= order_.operations; ++i) Store(i);
    RecordedDisk disk(live_);
    Plant(disk, order_.fault);
    ClosedLogs full(live_, "m", {.quota_bytes = 1, .needs_shipping = true, .reserve_bytes = kAllFull}, false);
    for (int i = 0; i < order_.operations; ++i) {
      const std::string next = NextPlain();
      if (random_() % 2 == 0 && !next.empty()) {
        const Result<> done = CompressLog(live_ + '/' + next, 0, [](CompressionStep) { return true; });
        if (!done) return tally_.Breach(done.error().text);
      } else {
        full.Tend("", (i + 1) * kSecond, kNow);
      }
    }
    CutEverywhere(
        disk, order_, memory_.path() + "/cut",
        [&](std::size_t, const std::string& folder) { return Check(folder); }, tally_);
  }

 private:
  void Store(int hours) {
    const std::string file = LogFileName("m", kNow - hours * kHour, 0);
    ScriptedLog log(0, kNow - hours * kHour);
    log.Add(kRecorderChannel, R"({"name":"m","host":"h","start_utime":1,"file_number":1})");
    for (int i = 0; i < 20; ++i)
      log.Add("A", std::string(random_() % 300, static_cast<char>('a' + random_() % 26)));
    contents_[file] = log.bytes();
    std::ofstream(live_ + '/' + file, std::ios::binary) << AsText(log.bytes());
  }
  [[nodiscard]] std::string NextPlain() const {
    for (const auto& [file, content] : contents_) {
      if (std::filesystem::exists(live_ + '/' + file)) return file;
    }
    return "";
  }

  // Every log is complete, or a hole. The recorder that starts then leaves neither a part of a log nor a hole of one that is there.
  std::string Check(const std::string& folder) {
    std::string breach = CheckLogs(folder);
    if (!breach.empty()) return breach;
    ClosedLogs started(folder, "m", {.quota_bytes = 1, .needs_shipping = true}, false);
    started.Tend("", kSecond, kNow);
    breach = CheckLogs(folder);
    if (!breach.empty()) return "after a start: " + breach;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      std::string log;
      const std::string file = entry.path().filename().string();
      if (IsUnfinishedCompression(file, log)) return file + " stays";
    }
    return CheckHolesOfShippedLogs(folder);
  }

  std::string CheckLogs(const std::string& folder) {
    const auto holes = ReadHoles(folder, {});
    if (!holes) return holes.error().text;
    for (const auto& [file, content] : contents_) {
      const auto times = std::count_if(holes->begin(), holes->end(),
                                       [&name = file](const LogHole& hole) { return hole.file == name; });
      const bool exists = LogExists(folder, file);
      if (times != (exists ? 0 : 1))
        return file + (exists ? " is there and" : " is gone and") + " a hole " + std::to_string(times) + " times";
      for (const std::string& path : {folder + '/' + file, folder + '/' + file + std::string(kCompressedEnding)}) {
        if (!std::filesystem::exists(path)) continue;
        const OpenedLog log(path);
        if (!log.problem().empty() || !log.damage().empty()) return path + ": " + log.problem() + log.damage();
        if (!std::ranges::equal(log.bytes(), content)) return path + " has another content";
      }
    }
    return "";
  }

  // All logs are shipped and deleted: none of them was a hole.
  std::string CheckHolesOfShippedLogs(const std::string& folder) {
    const std::size_t before = ReadHoles(folder, {})->size();
    for (const auto& [file, content] : contents_) {
      std::filesystem::remove(folder + '/' + file);
      std::filesystem::remove(folder + '/' + file + std::string(kCompressedEnding));
    }
    return ReadHoles(folder, {})->size() == before ? "" : "a log that was there has a line in holes.jsonl";
  }

  const CutOrder order_;
  CutTally& tally_;
  const MemoryFolder memory_;
  const std::string live_ = memory_.path() + "/live";
  std::mt19937_64 random_;
  std::map<std::string, std::vector<std::uint8_t>> contents_;  // of the logs
};

}  // namespace

CutTally CutOutbox(const CutOrder& order) {
  CutTally tally;
  OutboxCheck(order, tally).Run();
  return tally;
}

}  // namespace axlecast
