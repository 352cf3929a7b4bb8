#include "tests/simulation/recorder_process.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/base/text.h"
#include "core/messages/origin.h"
#include "tools/log/log_reader.h"

namespace axlecast::simulation {
namespace {

// What is older than this is on the disk: the longest time until written data is synced, and the cycle of this process.
constexpr MonoNs kDurableAfter = 100 * kMillisecond + 2 * 100 * kMillisecond + 50 * kMillisecond;

std::uint64_t HashOf(std::string_view channel, Bytes data) {
  return static_cast<std::uint64_t>(NameHash(channel)) * 31 +
         static_cast<std::uint64_t>(NameHash({reinterpret_cast<const char*>(data.data()), data.size()}));
}

std::set<std::string> NamesIn(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

std::string NumberText(const char* what, std::size_t number) {
  return std::string(what) + " " + std::to_string(number);
}

std::vector<std::uint8_t> ReadFile(const std::string& path) {
  std::vector<std::uint8_t> bytes(std::filesystem::file_size(path));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

}  // namespace

void RecorderProcess::Start() {
  former_logs_ = NamesIn(disk_.folder());
  LogWriterSettings settings;
  settings.folder = disk_.folder();
  settings.name = "all";
  writer_ = std::make_unique<LogWriter>(settings, host_.clock);
  RecorderSettings recorder;
  recorder.identity.name = "all";
  recorder.identity.host = host_.name;
  composer_ = std::make_unique<LogComposer>(std::move(recorder), *writer_);
  composer_->Start(host_.clock.Now(), host_.clock.UtcMicroseconds());
  membership_ = network_.Join(host_, Port::kData,
                              [this](const std::string& channel, Bytes message) { OnMessage(channel, message); });
  arrivals_.clear();
  numbers_.clear();
  Cycle(++life_);
}

void RecorderProcess::OnMessage(const std::string& channel, Bytes message) {
  composer_->On({.number = 0, .utime = host_.clock.UtcMicroseconds(), .channel = channel, .data = message},
                host_.clock.Now());
  arrivals_.push_back({HashOf(channel, message), schedule_.now()});
  if (!channel.starts_with("POSITION/")) return;
  const std::int64_t boot_id = ReadInt64(message, 24);
  const std::int64_t seq = ReadInt64(message, 32);
  Numbers& numbers = numbers_.try_emplace({channel, boot_id}, Numbers{seq, seq, {}}).first->second;
  if (seq < numbers.first) return;  // what was sent before the first that arrived is not missed
  numbers.last = std::max(numbers.last, seq);
  numbers.all.insert(seq);
}

void RecorderProcess::Cycle(std::int64_t life) {
  if (life != life_) return;
  composer_->Poll(host_.clock.Now(), host_.clock.UtcMicroseconds());
  writer_->Poll();
  schedule_.After(kCycle + host_.Late(), [this, life] { Cycle(life); });
}

void RecorderProcess::Kill(const CutChoice& choice) {
  if (!runs()) return;
  ++life_;
  network_.Leave(membership_);
  disk_.Crash(choice);
  composer_.reset();
  writer_.reset();
  disk_.Sweep();
  JudgeLogs(false);
}

void RecorderProcess::Stop() {
  if (!runs()) return;
  ++life_;
  network_.Leave(membership_);
  JudgeLosses();
  composer_->End(host_.clock.UtcMicroseconds());
  if (writer_->Finish() != 0) promises_.Breach("the recorder could not write its last messages");
  composer_.reset();
  writer_.reset();
  JudgeLogs(true);
}

// By the numbers that arrived: the recorder must count as lost what is missing between them.
void RecorderProcess::JudgeLosses() {
  std::map<std::string, std::int64_t> missing;
  for (const auto& [key, numbers] : numbers_) {
    const std::int64_t lost = numbers.last - numbers.first + 1 - static_cast<std::int64_t>(numbers.all.size());
    if (lost > 0) missing[key.first] += lost;
  }
  std::map<std::string, std::int64_t> counted;
  for (const ChannelLoss& loss : composer_->channels().losses()) {
    if (loss.channel.starts_with("POSITION/")) counted[loss.channel] = loss.lost;
  }
  for (const auto& [channel, lost] : missing)
    promises_.Count("messages that the recorder must count as lost", lost);
  if (missing == counted) return;
  for (const auto& [channel, lost] : missing) {
    if (counted[channel] != lost)
      promises_.Breach(Text("%s: %lld messages are missing, the recorder counts %lld", channel.c_str(),
                            static_cast<long long>(lost), static_cast<long long>(counted[channel])));
  }
}

void RecorderProcess::JudgeLogs(bool complete) {
  // The logs of earlier lives were judged then.
  std::string path;
  for (const std::string& name : NamesIn(disk_.folder())) {
    if (!former_logs_.contains(name)) path = disk_.folder() + "/" + name;
  }
  if (path.empty()) return;
  const std::vector<std::uint8_t> log = ReadFile(path);
  // Of what was not synced yet, a power cut may leave any part.
  const auto may_be_lost = [&](std::size_t arrival) {
    return !complete && arrivals_[arrival].at > schedule_.now() - kDurableAfter;
  };
  LogReader reader(log);
  std::size_t next = 0;  // arrival
  std::int64_t events = 0;
  while (const auto event = reader.Next()) {
    if (event->channel.starts_with("AXLECAST/")) continue;  // header events and seals
    const std::uint64_t hash = HashOf(event->channel, event->data);
    std::size_t found = next;
    while (found < arrivals_.size() && arrivals_[found].hash != hash) ++found;
    const std::size_t place = found == arrivals_.size() ? next : found;
    for (; next < place; ++next) {
      if (!may_be_lost(next)) return promises_.Breach(NumberText("arrival", next) + " is missing in the log");
    }
    if (found < arrivals_.size()) {
      ++next;
      ++events;
    } else if (next == arrivals_.size() || !may_be_lost(next)) {
      return promises_.Breach(NumberText("event", static_cast<std::size_t>(events)) +
                              " of a log is not what arrived");
    }
  }
  promises_.Count("log events compared with what arrived", events);
  if (next < arrivals_.size() && !may_be_lost(next))
    promises_.Breach(Text("a log ends %.3f s before the end of its recorder",
                          static_cast<double>(schedule_.now() - arrivals_[next].at) * 1e-9));
}

}  // namespace axlecast::simulation
