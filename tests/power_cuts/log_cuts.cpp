#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "platform/os/mapped_file.h"
#include "tests/disk/memory_folder.h"
#include "tests/power_cuts/power_cuts.h"
#include "tests/support/fake_clock.h"
#include "tools/log/log_reader.h"
#include "tools/recorder/log_composer.h"
#include "tools/recorder/log_writer.h"

namespace axlecast {
namespace {

constexpr MonoNs kSyncInterval = 100 * kMillisecond;

// A message: its channel is unique, so that it shows which message an event was.
struct Message {
  std::string channel;
  std::string data;
  MonoNs given = 0;                // to the recorder
  std::size_t begun = 0;           // point of the disk at that time
  std::size_t durable = SIZE_MAX;  // point from which on it must be there
};

// A recorder, without network and threads.
class Recorder {
 public:
  Recorder(RecordedDisk& disk, FakeClock& clock, std::vector<Message>& messages, LogWriterSettings settings,
           std::uint64_t split_bytes)
      : disk_(disk),
        clock_(clock),
        messages_(messages),
        first_(messages.size()),
        writer_(std::move(settings), clock),
        composer_(SettingsOf(split_bytes), writer_) {}

  void Start() { composer_.Start(clock_.Now(), clock_.UtcMicroseconds()); }
  void Continue(const LogTail& tail) {
    writer_.Append(static_cast<std::int64_t>(tail.size));
    composer_.Continue(tail, clock_.Now(), clock_.UtcMicroseconds());
  }

  void Give(std::string data) {
    messages_.push_back({"M" + std::to_string(messages_.size()), std::move(data), clock_.Now(), disk_.position()});
    const Message& message = messages_.back();
    composer_.On({.utime = clock_.UtcMicroseconds(), .channel = message.channel, .data = AsBytes(message.data)},
                 clock_.Now());
  }
  // As the recorder's thread does it. `early`: claims too much.
  void Poll(bool early) {
    composer_.Poll(clock_.Now(), clock_.UtcMicroseconds());
    const std::size_t before = disk_.position();
    writer_.Poll();
    // docs/record.md: a power failure loses at most the last MS milliseconds.
    if (early) return Claim(clock_.Now(), before);
    Claim(clock_.Now() - kSyncInterval, disk_.position());
  }
  [[nodiscard]] bool Finish() {
    composer_.End(clock_.UtcMicroseconds());
    const bool written = writer_.Finish() == 0 && !writer_.status().damaged;
    Claim(clock_.Now(), disk_.position());
    return written;
  }

 private:
  static RecorderSettings SettingsOf(std::uint64_t split_bytes) {
    RecorderSettings settings;
    settings.identity.name = "m";
    settings.identity.machine = "machine: press3\n";
    settings.split_bytes = split_bytes;
    return settings;
  }
  // What was given until then is durable from this point on.
  void Claim(MonoNs until, std::size_t point) {
    for (std::size_t i = first_; i < messages_.size(); ++i) {
      if (messages_[i].given <= until) messages_[i].durable = std::min(messages_[i].durable, point);
    }
  }

  RecordedDisk& disk_;
  FakeClock& clock_;
  std::vector<Message>& messages_;
  const std::size_t first_;  // of this recorder
  LogWriter writer_;
  LogComposer composer_;
};

// How often each message is in the logs of a folder, undamaged.
using Found = std::map<std::string, int>;

class LogCheck {
 public:
  LogCheck(const CutOrder& order, CutTally& tally) : order_(order), tally_(tally), random_(order.seed) {}

  void Run() {
    const std::string live = memory_.path() + "/live";
    std::filesystem::create_directory(live);
    RecordedDisk disk(live);
    Plant(disk, order_.fault);
    // Every second recording is one file, which can be continued.
    const bool one_file = order_.seed % 2 == 0;
    Recorder recorder(disk, clock_, messages_, SettingsOf(live, one_file), one_file ? 0 : 100'000);
    recorder.Start();
    Record(recorder, order_.operations);
    if (!recorder.Finish()) return tally_.Breach("the recorder lost messages");
    CutEverywhere(
        disk, order_, memory_.path() + "/cut",
        [&](std::size_t point, const std::string& folder) {
          std::string breach = Check(point, folder, messages_);
          const std::string file = folder + "/run.lcm";
          const bool again = one_file && order_.second_cuts > 0 && ++checks_ % order_.second_cuts == 0;
          if (!breach.empty() || !again || !std::filesystem::exists(file)) return breach;
          return CutContinued(point, folder);
        },
        tally_);
  }

 private:
  static LogWriterSettings SettingsOf(const std::string& folder, bool one_file) {
    LogWriterSettings settings;
    settings.folder = folder;
    settings.name = "m";
    settings.sync_interval = kSyncInterval;
    if (one_file) settings.file = folder + "/run.lcm";
    return settings;
  }
  void Record(Recorder& recorder, int operations) {
    for (int i = 0; i < operations; ++i) {
      clock_.Advance(static_cast<MonoNs>(random_() % 120) * kMillisecond);
      const std::uint64_t count = random_() % 4;
      for (std::uint64_t k = 0; k < count; ++k) {
        // A zero at no place: zeros in a file that has grown are no data.
        recorder.Give(
            std::string(random_() % 10 == 0 ? 3'000 : random_() % 300, static_cast<char>('a' + random_() % 26)));
      }
      recorder.Poll(order_.fault == PlantedFault::kEarlyClaim);
    }
  }

  // Checks all logs in the folder against what was recorded and must be durable.
  static std::string Check(std::size_t point, const std::string& folder, const std::vector<Message>& messages) {
    Found found;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const MappedFile file(entry.path().string());
      if (!file.problem().empty()) return file.problem();
      const std::string breach = Read(file.bytes(), messages, found);
      if (!breach.empty()) return entry.path().filename().string() + ": " + breach;
    }
    for (const Message& message : messages) {
      const int times = found[message.channel];
      if (message.durable <= point && times == 0) return message.channel + " was durable and is lost";
      if (times > 1) return message.channel + " is in the logs " + std::to_string(times) + " times";
      if (message.begun > point && times > 0) return message.channel + " was not recorded yet";
    }
    return "";
  }

  // Counts the messages of a log. A seal that matches must cover only messages as they were recorded.
  static std::string Read(Bytes log, const std::vector<Message>& messages, Found& found) {
    LogReader reader(log);
    SealCount count;
    std::string changed;  // since the last seal
    while (const auto event = reader.Next()) {
      if (event->channel == kSealChannel) {
        const bool matches = ParseSeal(event->data) == count.seal();
        if (matches && !changed.empty()) return changed + " was changed, and a seal covers it";
        count.Reset();
        changed.clear();
        continue;
      }
      count.Add(log.subspan(reader.offset(), EventSize(*event)));
      if (IsLogChannel(event->channel)) continue;
      const auto recorded = std::find_if(messages.begin(), messages.end(),
                                         [&](const Message& one) { return one.channel == event->channel; });
      if (recorded != messages.end() && recorded->data == AsText(event->data)) {
        ++found[recorded->channel];
      } else {
        // A log that is continued is sealed as it is then: docs/log.md.
        const bool is_known = recorded != messages.end() && recorded->durable == SIZE_MAX && recorded->begun == 0;
        if (!is_known) changed = std::string(event->channel);
      }
    }
    return "";
  }

  // Continues the log after the cut (--append), and cuts the power of that too.
  std::string CutContinued(std::size_t first_point, const std::string& folder) {
    RecordedDisk disk(folder);
    std::vector<Message> messages;
    for (Message message : messages_) {
      // What was not durable then may be there or not.
      message.durable = message.durable <= first_point ? 0 : SIZE_MAX;
      message.begun = message.begun <= first_point ? 0 : SIZE_MAX;
      messages.push_back(std::move(message));
    }
    const std::string path = folder + "/run.lcm";
    {
      const MappedFile file(path);
      const LogTail tail = FindTail(file.bytes());
      Recorder recorder(disk, clock_, messages, SettingsOf(folder, true), 0);
      recorder.Continue(tail);
      Record(recorder, 6);
      if (!recorder.Finish()) return "the log cannot be continued";
    }
    std::string breach = Check(disk.position(), folder, messages);
    if (!breach.empty()) return "after it was continued: " + breach;
    for (int i = 0; i < 3 && breach.empty(); ++i) {
      const std::size_t point = random_() % (disk.position() + 1);
      disk.Cut(point, {CutChoice::Kind::kRandom, random_()}, memory_.path() + "/second");
      ++tally_.states;
      ++tally_.second_cuts;
      breach = Check(point, memory_.path() + "/second", messages);
      if (!breach.empty()) breach = "after a second cut, " + std::to_string(point) + ": " + breach;
    }
    return breach;
  }

  const CutOrder order_;
  CutTally& tally_;
  const MemoryFolder memory_;
  FakeClock clock_;
  std::mt19937_64 random_;
  std::vector<Message> messages_;
  std::size_t checks_ = 0;
};

}  // namespace

CutTally CutLogs(const CutOrder& order) {
  CutTally tally;
  LogCheck(order, tally).Run();
  return tally;
}

}  // namespace axlecast
