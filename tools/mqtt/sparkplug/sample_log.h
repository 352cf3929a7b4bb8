#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "platform/os/folder.h"
#include "platform/os/log_file.h"
#include "tools/log/log_event.h"

namespace axlecast {

// A message that was selected for publication: the LCM message itself, because names and aliases of metrics may change.
struct StoredSample {
  std::int64_t number = 0;  // increasing; not without gaps
  std::int64_t utime = 0;   // us, UNIX time of its reception
  std::string channel;
  std::vector<std::uint8_t> message;
};

// Up to where the broker has the samples: all with numbers below `number`, the newest of them received at `utime`.
struct SampleMark {
  std::int64_t number = 0;
  std::int64_t utime = 0;  // us, UNIX time; 0: none is confirmed
  bool operator==(const SampleMark&) const = default;
};
inline constexpr std::string_view kMarkChannel = "AXLECAST/sparkplug";
// The data of its event: "confirmed NUMBER UTIME". ParseMark returns nothing for any other text.
[[nodiscard]] std::string FormatMark(const SampleMark& mark);
[[nodiscard]] std::optional<SampleMark> ParseMark(std::string_view text);

struct SampleLogSettings {
  std::string folder;                   // created if it is missing
  std::int64_t max_bytes = 256 << 20;   // of all files; the oldest samples are dropped first
  MonoNs sync_interval = kSecond;       // a power failure loses at most the samples of this time
  std::int64_t repeat_us = 10'000'000;  // us: see Resume
};

struct SampleLogCounts {
  std::int64_t stored = 0;    // since the start, as all below
  std::int64_t dropped = 0;   // unconfirmed samples that were removed because the log was full
  std::int64_t unstored = 0;  // samples that the disk did not take
  std::int64_t damaged = 0;   // stretches between two seals whose check sum was wrong; their samples are lost
  std::int64_t bytes = 0;     // of all files now
};

// The outbox on disk: samples in the order of their reception, as LCM event logs (samples_<number of the first event>.lcm),
// which every tool that reads logs can read. A sample is stored before it is published, and confirmed when the broker has it. The
// newest confirmation is an event of the log too (kMarkChannel).
//
// When Append returns, the kernel has the sample: killing the process loses nothing. Poll seals and syncs the log every
// `sync_interval`: a power failure loses at most the samples of that time.
class SampleLog {
 public:
  explicit SampleLog(SampleLogSettings settings);

  // Opens the log and continues it after the last complete record. Fails if the folder cannot be used, or if another process
  // uses it.
  [[nodiscard]] Result<> Open();

  // Stores a sample. Returns its number.
  std::int64_t Append(std::string_view channel, Bytes message, std::int64_t utime, MonoNs now);
  // Seals and syncs when it is due.
  void Poll(MonoNs now);
  // Seals, syncs and closes the file.
  void Close(std::int64_t utime);

  [[nodiscard]] std::int64_t next() const { return next_; }  // number of the next sample
  // Returns the number from which samples must be sent in a new session: the first unconfirmed one, or an earlier one that was
  // received within `repeat` before the last confirmation.
  [[nodiscard]] std::int64_t Resume();
  // Returns samples with numbers in [from, to), at most `limit`.
  [[nodiscard]] std::vector<StoredSample> Read(std::int64_t from, std::int64_t to, std::size_t limit);
  // The broker has all samples below `number`; the newest of them was received at `utime`.
  void Confirm(std::int64_t number, std::int64_t utime);
  [[nodiscard]] std::int64_t confirmed() const { return mark_.number; }

  [[nodiscard]] const SampleLogCounts& counts() const { return counts_; }
  [[nodiscard]] const std::string& problem() const {
    return problem_;
  }  // why the disk took no sample; empty: it does

 private:
  struct Segment {
    std::int64_t first = 0;  // number of its first event
    std::int64_t bytes = 0;
    std::int64_t first_utime = 0;
  };
  [[nodiscard]] std::string PathOf(const Segment& segment) const;
  [[nodiscard]] Result<> FindSegments();
  [[nodiscard]] Result<> Continue();
  [[nodiscard]] int Begin(std::int64_t utime);
  [[nodiscard]] int Write(const LogEvent& event);
  [[nodiscard]] int WriteRecord(Bytes record);
  [[nodiscard]] bool Store(const LogEvent& event);
  void Seal();
  void RemoveOldest();
  void RemoveConfirmed();
  [[nodiscard]] std::vector<StoredSample> ReadSegment(const Segment& segment, std::int64_t from, std::int64_t to,
                                                      std::size_t limit);

  SampleLogSettings settings_;
  LockFile lock_;
  std::vector<Segment> segments_;  // oldest first; the last one is written if file_ is open
  LogFile file_;
  LogEncoder encoder_;
  std::int64_t next_ = 0;
  SampleMark mark_;
  std::int64_t last_utime_ = 0;
  MonoNs unsynced_since_ = kNever;
  std::int64_t damage_seen_ = -1;  // number of the seal of the newest damaged stretch that was counted
  SampleLogCounts counts_;
  std::string problem_;
};

}  // namespace axlecast
