#pragma once

#include <cstdint>
#include <optional>

#include "core/device/device.h"
#include "drivers/kit/stream.h"
#include "drivers/saa_serial/reading.h"

namespace axlecast::saa_serial {

// What the encoder says, towards the outside: samples, errors by kind, and where its position jumps because it was
// cleared to zero. All of it follows from the events alone, whoever made the requests and why; so a recorded
// sequence of events gives the same again.
class Interpreter {
 public:
  Interpreter(const BusConfig& bus, const SaaSettings& settings, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  // `zeroing`: the request to clear to zero was under way.
  void OnLinkDown(bool zeroing, MonoNs now);
  // Any other event. Afterwards Next, until it has nothing left: it reports each reading to the output.
  void Take(const Event& event);
  [[nodiscard]] std::optional<Reading> Next();

  // Good frames come: not before the first one after the link came up, and no more after the stream fell silent, or
  // after two requests in a row that brought not a single byte.
  [[nodiscard]] bool answering() const { return answering_; }
  // WaitForIdleLine for so long before the next request; 0: the line is free.
  [[nodiscard]] MonoNs quiet_needed() const { return quiet_needed_; }
  // When the stream is to be missed.
  [[nodiscard]] MonoNs silent_at() const { return cadence_.due(); }
  // A reading sampled at or after this instant shows the effect of the last clearing to zero.
  [[nodiscard]] MonoNs effect_from() const { return effect_from_; }

 private:
  void OnStream(const Event& event);
  void OnPolled(const Event& event);
  void OnStray(const Event& event);
  void BeginJump(MonoNs now);
  void Judge(const Reading& reading);
  [[nodiscard]] std::optional<Reading> NextOfStream();

  const Mode mode_;
  const SaaSettings& settings_;
  const bool guards_line_;  // of all devices on the bus, the one that asks for silence after stray bytes
  const MonoNs character_;  // 0 where the wire is simulated
  const StreamTimes times_;
  DeviceOutput& output_;

  StreamParser parser_;
  StalledFrames stalled_;
  PeriodMonitor cadence_;
  MonoNs emptied_ = 0;             // all bytes from before this instant had been read then
  bool all_read_ = true;           // by the newest read
  std::optional<Reading> polled_;  // until Next hands it over

  bool answering_ = false;
  int silent_in_a_row_ = 0;
  MonoNs quiet_needed_ = 0;
  bool jumping_ = false;
  MonoNs effect_from_ = 0;
};

}  // namespace axlecast::saa_serial
