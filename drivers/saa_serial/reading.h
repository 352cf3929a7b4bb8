#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/device/reading.h"
#include "core/device/step.h"
#include "drivers/saa_serial/settings.h"
#include "drivers/saa_serial/stream_parser.h"

namespace axlecast::saa_serial {

// What one exchange, or one place in the stream, gave.
struct Reading {
  std::optional<ErrorKind> error;  // nothing: a position
  std::uint32_t counts = 0;
  Interval at;  // of a position: holds the sampling instant; else of the bytes
};

// The reply to a request for a position, or to a pulse on CLK: a function of the event alone. Bytes before the
// frame's FF, as a line that changes its direction brings them, are passed over.
struct PolledReading {
  Reading reading;
  std::size_t stray = 0;  // bytes before the frame
};
[[nodiscard]] PolledReading ReadReply(const Event& event, const Format& format, MonoNs character);

// Length of the reply of an encoder of `bits`: its frame begins with the first FF that no other FF follows.
[[nodiscard]] ReplyLength LengthRule(int bits);
// Where that frame begins.
[[nodiscard]] std::size_t BeginOfReply(Bytes so_far);
// Returns what distinguishes the encoder's replies from others on its bus: its address, if the reply must contain it.
[[nodiscard]] ReplyShape ShapeOf(const Format& format);

// How long what came unasked can have been under way: README.md, "Instant of a position".
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

// Returns the time at which the event ended.
[[nodiscard]] MonoNs EndOf(const Event& event);

}  // namespace axlecast::saa_serial
