#include "tools/mqtt/sparkplug/sample_log.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

#include "core/base/text.h"
#include "platform/os/mapped_file.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

constexpr std::string_view kNameBegin = "samples_";
constexpr std::string_view kNameEnd = ".lcm";
constexpr int kNumberDigits = 19;  // of the largest number, so that the order of names is that of numbers
constexpr std::int64_t kMinSegment = 64 << 10;
constexpr std::int64_t kMaxSegment = 1 << 20;  // Read parses a whole file
constexpr int kSegments = 8;                   // of a full log, at least

constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

std::int64_t SegmentBytes(std::int64_t max_bytes) {
  return std::clamp(max_bytes / kSegments, kMinSegment, kMaxSegment);
}

std::string NameOf(std::int64_t first) {
  return Text("samples_%0*lld.lcm", kNumberDigits, static_cast<long long>(first));
}

// Reads a whole number >= 0 that fills the text.
std::optional<std::int64_t> ParseNumber(std::string_view text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 0) return std::nullopt;
  return number;
}

std::optional<std::int64_t> FirstOf(std::string_view name) {
  if (!name.starts_with(kNameBegin) || !name.ends_with(kNameEnd)) return std::nullopt;
  if (name.size() != kNameBegin.size() + kNumberDigits + kNameEnd.size()) return std::nullopt;
  return ParseNumber(name.substr(kNameBegin.size(), kNumberDigits));
}

}  // namespace

std::string FormatMark(const SampleMark& mark) {
  return "confirmed " + std::to_string(mark.number) + ' ' + std::to_string(mark.utime);
}

std::optional<SampleMark> ParseMark(std::string_view text) {
  constexpr std::string_view kWord = "confirmed ";
  if (!text.starts_with(kWord)) return std::nullopt;
  text.remove_prefix(kWord.size());
  const std::size_t blank = text.find(' ');
  if (blank == std::string_view::npos) return std::nullopt;
  const auto number = ParseNumber(text.substr(0, blank));
  const auto utime = ParseNumber(text.substr(blank + 1));
  if (!number || !utime) return std::nullopt;
  return SampleMark{*number, *utime};
}

SampleLog::SampleLog(SampleLogSettings settings) : settings_(std::move(settings)) {}

std::string SampleLog::PathOf(const Segment& segment) const {
  return settings_.folder + '/' + NameOf(segment.first);
}

Result<> SampleLog::Open() {
  if (Result<> made = MakeFolders(settings_.folder, 0700); !made) return made;
  if (Result<> locked = lock_.Acquire(settings_.folder + "/lock"); !locked) {
    return Failure(locked.error().text + ": does another `axlecast mqtt` use this state folder?");
  }
  if (Result<> found = FindSegments(); !found) return found;
  return segments_.empty() ? Result<>() : Continue();
}

Result<> SampleLog::FindSegments() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(settings_.folder, error)) {
    const auto first = FirstOf(entry.path().filename().string());
    if (!first) continue;
    const MappedFile file(entry.path().string());
    if (!file.problem().empty()) return Failure(file.problem());
    const auto begin = LogReader(file.bytes()).Next();
    segments_.push_back({*first, static_cast<std::int64_t>(file.bytes().size()), begin ? begin->utime : 0});
    counts_.bytes += segments_.back().bytes;
  }
  if (error) return Failure(settings_.folder + ": " + error.message());
  std::sort(segments_.begin(), segments_.end(),
            [](const Segment& one, const Segment& other) { return one.first < other.first; });
  return {};
}

// Cuts a torn record from the end of the newest file, and continues it.
Result<> SampleLog::Continue() {
  Segment& newest = segments_.back();
  LogTail tail;
  {
    const MappedFile file(PathOf(newest));
    if (!file.problem().empty()) return Failure(file.problem());
    tail = FindTail(file.bytes());
    LogReader reader(file.bytes());
    while (const auto event = reader.Next()) {
      last_utime_ = event->utime;
      if (event->channel != kMarkChannel) continue;
      mark_ = ParseMark(AsText(event->data)).value_or(mark_);
    }
  }
  next_ = std::max(newest.first, tail.next_number);
  encoder_ = LogEncoder(next_, tail.size, tail.open);
  if (const int error = file_.Continue(PathOf(newest), static_cast<std::int64_t>(tail.size)); error != 0) {
    return Failure(PathOf(newest) + ": " + std::strerror(error));
  }
  counts_.bytes += static_cast<std::int64_t>(tail.size) - newest.bytes;
  newest.bytes = static_cast<std::int64_t>(tail.size);
  return {};
}

std::int64_t SampleLog::Append(std::string_view channel, Bytes message, std::int64_t utime, MonoNs now) {
  last_utime_ = utime;
  if (!Store({.utime = utime, .channel = channel, .data = message})) {
    ++counts_.unstored;
    return next_;
  }
  ++counts_.stored;
  if (unsynced_since_ == kNever) unsynced_since_ = now;
  return next_ - 1;  // a new file begins with an event of its own
}

// Writes an event; on a full disk, in the place of the oldest samples.
bool SampleLog::Store(const LogEvent& event) {
  int error = Write(event);
  if ((error == ENOSPC || error == EDQUOT) && segments_.size() > 1) {
    RemoveOldest();
    error = Write(event);
  }
  problem_ = error == 0 ? "" : settings_.folder + ": " + std::strerror(error);
  while (counts_.bytes > settings_.max_bytes && segments_.size() > 1) RemoveOldest();
  return error == 0;
}

int SampleLog::Write(const LogEvent& event) {
  if (file_.is_open() && file_.size() >= SegmentBytes(settings_.max_bytes)) {
    Seal();
    static_cast<void>(file_.Close());
  }
  if (!file_.is_open()) {
    if (const int error = Begin(event.utime); error != 0) return error;
  }
  return WriteRecord(encoder_.Add({.utime = event.utime, .channel = event.channel, .data = event.data}));
}

// Begins a file with the mark, so that the newest file always has it.
int SampleLog::Begin(std::int64_t utime) {
  const Segment segment{.first = next_, .first_utime = utime};
  if (const int error = file_.Create(PathOf(segment)); error != 0) return error;
  segments_.push_back(segment);
  encoder_ = LogEncoder(next_, 0, {});
  const std::string mark = FormatMark(mark_);
  return WriteRecord(encoder_.Add({.utime = utime, .channel = kMarkChannel, .data = AsBytes(mark)}));
}

// A record that was not written completely is cut off. The encoder then has to forget it as well.
int SampleLog::WriteRecord(Bytes record) {
  Bytes rest = record;
  const std::int64_t before = file_.size();
  const int error = file_.Write(rest);
  if (error == 0) {
    ++next_;
    segments_.back().bytes += static_cast<std::int64_t>(record.size());
    counts_.bytes += static_cast<std::int64_t>(record.size());
    return 0;
  }
  static_cast<void>(file_.CutTo(before));
  const MappedFile file(PathOf(segments_.back()));
  const LogTail tail = FindTail(file.bytes());
  encoder_ = LogEncoder(next_, tail.size, tail.open);
  return error;
}

void SampleLog::Seal() {
  const Bytes record = encoder_.Seal(last_utime_);
  if (!record.empty()) static_cast<void>(WriteRecord(record));
}

void SampleLog::Poll(MonoNs now) {
  if (unsynced_since_ == kNever || now - unsynced_since_ < settings_.sync_interval) return;
  unsynced_since_ = kNever;
  if (!file_.is_open()) return;
  Seal();
  if (const int error = file_.Sync(); error != 0) problem_ = settings_.folder + ": " + std::strerror(error);
  RemoveConfirmed();
}

void SampleLog::Close(std::int64_t utime) {
  last_utime_ = std::max(last_utime_, utime);
  if (!file_.is_open()) return;
  Seal();
  static_cast<void>(file_.Close());
}

std::int64_t SampleLog::Resume() {
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    if (i + 1 < segments_.size() && segments_[i + 1].first <= mark_.number &&
        segments_[i + 1].first_utime < mark_.utime - settings_.repeat_us) {
      continue;
    }
    for (const StoredSample& sample : ReadSegment(segments_[i], 0, kEnd, kAll)) {
      if (sample.number >= mark_.number || sample.utime > mark_.utime - settings_.repeat_us) return sample.number;
    }
  }
  return next_;
}

std::vector<StoredSample> SampleLog::Read(std::int64_t from, std::int64_t to, std::size_t limit) {
  std::vector<StoredSample> samples;
  for (std::size_t i = 0; i < segments_.size() && segments_[i].first < to && samples.size() < limit; ++i) {
    if (i + 1 < segments_.size() && segments_[i + 1].first <= from) continue;
    std::vector<StoredSample> more = ReadSegment(segments_[i], from, to, limit - samples.size());
    std::move(more.begin(), more.end(), std::back_inserter(samples));
  }
  if (samples.size() > limit) samples.resize(limit);
  return samples;
}

// Samples between two seals are returned only if their check sum is right. Ends at the first seal after `limit` samples, or later.
std::vector<StoredSample> SampleLog::ReadSegment(const Segment& segment, std::int64_t from, std::int64_t to,
                                                 std::size_t limit) {
  const MappedFile file(PathOf(segment));
  std::vector<StoredSample> samples;
  SealCount count;
  std::size_t checked = 0;  // of `samples`
  LogReader reader(file.bytes());
  while (const auto event = reader.Next()) {
    if (event->channel == kSealChannel) {
      if (ParseSeal(event->data) == count.seal()) {
        checked = samples.size();
      } else {
        samples.resize(checked);
        if (event->number > damage_seen_) ++counts_.damaged;
        damage_seen_ = std::max(damage_seen_, event->number);
      }
      count.Reset();
      if (checked >= limit) break;
      continue;
    }
    count.Add(file.bytes().subspan(reader.offset(), EventSize(*event)));
    if (event->channel == kMarkChannel || event->number < from || event->number >= to) continue;
    samples.push_back({.number = event->number,
                       .utime = event->utime,
                       .channel = std::string(event->channel),
                       .message = {event->data.begin(), event->data.end()}});
  }
  return samples;
}

void SampleLog::Confirm(std::int64_t number, std::int64_t utime) {
  if (number <= mark_.number) return;
  mark_ = {number, std::max(utime, mark_.utime)};
  const std::string mark = FormatMark(mark_);
  static_cast<void>(Store({.utime = last_utime_, .channel = kMarkChannel, .data = AsBytes(mark)}));
}

void SampleLog::RemoveOldest() {
  const Segment& oldest = segments_.front();
  if (segments_.size() < 2 || segments_[1].first > mark_.number) {
    counts_.dropped += static_cast<std::int64_t>(ReadSegment(oldest, mark_.number, kEnd, kAll).size());
  }
  static_cast<void>(std::remove(PathOf(oldest).c_str()));
  counts_.bytes -= oldest.bytes;
  segments_.erase(segments_.begin());
}

// A file is needed while a sample in it may have to be sent again.
void SampleLog::RemoveConfirmed() {
  while (segments_.size() > 1 && segments_[1].first <= mark_.number &&
         segments_[1].first_utime < mark_.utime - settings_.repeat_us) {
    RemoveOldest();
  }
}

}  // namespace axlecast
