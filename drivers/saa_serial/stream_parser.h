#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/device/reading.h"
#include "drivers/kit/stream.h"
#include "drivers/saa_serial/codec.h"

namespace axlecast::saa_serial {

// Finds the frames in the stream of an encoder that sends by itself (SAA manual 5.1.1, 5.1.2): FF, 81H, data within
// the resolution, checksum, all in the N bytes that the resolution asks for. The data can contain FF 81 and whole
// look-alikes of a frame. N bytes that pass all checks are a *candidate*; one that another candidate follows
// without a gap is *followed*.
//
// The rules. Bytes that begin no candidate are dropped one by one. A candidate is taken as soon as no later one can
// overlap it: mostly with its last byte. Of candidates that overlap,
//   1. one that is followed is right, and one that is not is a look-alike;
//   2. where several are followed: the one that begins where the last found frame ended; else the one nearest the
//      position found last, if that is at most kRecent frames ago; else none (ambiguous);
//   3. where none is followed: the one that begins whole frames behind the last found one, because a damaged frame
//      keeps its length; else the nearest, as in 2.; else the last, because the ones before it hold the bad bytes.
//
// What follows:
//   - Frames that are found come in their order in the stream, and never overlap; but a checksum of FF may turn out
//     to be the begin of the next frame, where a byte was lost.
//   - A candidate that overlaps no other one is always found, whatever came before it.
//   - Up to 16 bits a good frame that a good frame follows is always found, whatever came before it: among good
//     bytes only FF 81 02 FF 81 | FF 81 00 holds a look-alike, and none of a look-alike's neighbours is a candidate.
//   - Above 16 bits the same, but for the few positions at rest of README.md, "Positions that can be read in two
//     ways", as long as nothing was found within kRecent frames before.
//
// Allocates nothing. Holds back fewer than 3 N bytes.
class StreamParser {
 public:
  static constexpr int kRecent = 3;

  struct Found {
    // Set if there was no frame where one had to begin (kRange: because of bits above the resolution), once for each
    // frame length of dropped bytes. Then only `first` is set: the arrival of the dropped byte. Otherwise the fields below
    // hold the frame.
    std::optional<ErrorKind> error;
    std::uint32_t counts = 0;
    std::int64_t position = 0;  // of its first byte since the start of the stream
    Interval first;             // arrival of its first byte
    Interval last;              // and of its last
    // Bytes that came behind it in the same read; unknown of a frame that is older than the newest read.
    std::optional<std::size_t> behind;
  };

  explicit StreamParser(int bits) : format_{.bits = bits}, size_(ReplySize(bits)) {}

  // Bytes that arrived within `received`. Call Next until it has nothing left before the next Append.
  void Append(Bytes bytes, Interval received);
  [[nodiscard]] std::optional<Found> Next();
  // The stream was interrupted: what follows does not continue it.
  void Restart();

  [[nodiscard]] std::int64_t skipped() const { return skipped_; }  // bytes that belong to no frame found
  [[nodiscard]] std::int64_t ambiguous() const {
    return ambiguous_;
  }  // candidates that are followed and were not taken

 private:
  enum class Is : std::uint8_t { kNo, kOpen, kYes };  // kOpen: more bytes decide
  [[nodiscard]] Is Candidate(Bytes rest, std::size_t at, std::uint32_t* counts = nullptr) const;
  [[nodiscard]] bool Joined() const { return expected_ == position_; }  // begins where the last found frame ended
  // The byte at hand is the last one of the found frame, FF.
  [[nodiscard]] bool Shared() const { return expected_ && position_ < *expected_; }
  [[nodiscard]] bool Recent() const;                // at most kRecent frames after the last found one
  [[nodiscard]] bool InStep(std::size_t at) const;  // whole frames after it
  [[nodiscard]] std::int64_t FromLast(std::uint32_t counts) const;
  enum class Verdict : std::uint8_t { kTake, kSkip, kWait };
  [[nodiscard]] Verdict Evaluate(Bytes rest);
  [[nodiscard]] Verdict EvaluateRivals(Bytes rest);
  [[nodiscard]] std::optional<Found> Skip(Bytes rest);
  [[nodiscard]] Found Take(std::uint32_t counts);

  Format format_;
  std::size_t size_;
  ReceiveBuffer inbox_;
  std::size_t at_ = 0;                    // of the inbox's bytes: those before are done with
  std::int64_t position_ = 0;             // of that byte in the stream
  std::int64_t newest_ = 0;               // where the newest read begins in the stream
  std::int64_t end_ = 0;                  // where the stream ends so far
  std::optional<std::int64_t> expected_;  // where the last found frame ended
  std::uint32_t last_ = 0;                // its counts
  std::uint32_t counts_ = 0;              // of the candidate that Evaluate takes
  std::int64_t run_ = 0;                  // bytes skipped since the last found frame
  std::int64_t skipped_ = 0;
  std::int64_t ambiguous_ = 0;
};

// How long received bytes can have been under way: README.md, "Instant of a position".
struct StreamTimes {
  MonoNs character = 0;   // on the wire, at least; 0 where the wire is simulated and may be faster than a real one
  MonoNs slowest = 0;     // a character on the wire, at most
  MonoNs period = 0;      // of the frames
  MonoNs processing = 0;  // longest time from sampling to the frame's first bit
  MonoNs latency = 0;     // longest time that an adapter holds a byte back, but for a stall
  MonoNs late = 0;        // the same in a stall, which shows as a pause longer than period and latency
};
[[nodiscard]] Interval StreamedInstant(const StreamParser::Found& found, std::size_t frame_size,
                                       const StreamTimes& times);

// Widens the intervals of frames that an adapter hands over late, several at once, after a stall. Frames come in the order
// of their samples, one period apart: so a frame is at least one period younger than the frame before, however late it is.
// Nothing is widened while frames come in time.
class StalledFrames {
 public:
  explicit StalledFrames(const StreamTimes& times) : times_(times) {}

  // The line was opened at `now`; what came before does not continue.
  void Restart(MonoNs now);
  // Bytes came.
  void Arrived(MonoNs now);
  // Returns the interval of the next frame found in them. `at` is its StreamedInstant.
  [[nodiscard]] Interval Widened(Interval at);

 private:
  // `in_time`: where the interval begins of a frame that is not late.
  [[nodiscard]] MonoNs Earliest(MonoNs in_time);

  const StreamTimes times_;
  MonoNs arrived_ = 0;  // the newest bytes
  MonoNs until_ = 0;    // frames may be late until then
  // All frames of the stall have come but for a part of a period: so late may the frames still be, until the next pause.
  std::optional<MonoNs> behind_;
  std::optional<MonoNs> earliest_;  // of the frame before
};

}  // namespace axlecast::saa_serial
