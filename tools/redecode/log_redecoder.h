#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/config/machine_config.h"
#include "tools/log/log_event.h"
#include "tools/redecode/bus_redecoder.h"
#include "tools/redecode/recording_diff.h"

namespace axlecast {

// A whole log decoded again: each bus of which it holds a capture, and the comparison with the readings that stand
// beside it in the log.
class LogRedecoder {
 public:
  // Takes what the devices say, in order, as events numbered from 0 with the time of the WIRE message they came from.
  using Output = std::function<void(const LogEvent& event)>;

  // `machine` outlives it. `only_bus`: one bus of it; empty: all.
  LogRedecoder(const MachineConfig& machine, std::string_view only_bus, Output output);

  void On(const LogEvent& event);
  void Finish();

  // By name, of the buses that the log holds a capture of.
  [[nodiscard]] const std::map<std::string, std::unique_ptr<BusRedecoder>>& buses() const { return buses_; }
  [[nodiscard]] const RecordingDiff& diff() const { return diff_; }
  [[nodiscard]] std::int64_t malformed() const { return malformed_; }  // messages on WIRE channels that are none

 private:
  // Where one bus's devices speak.
  class Speech final : public MessageSink {
   public:
    explicit Speech(LogRedecoder& redecoder) : redecoder_(redecoder) {}
    void Publish(const std::string& channel, Bytes message) override { redecoder_.OnSpoken(channel, message); }

   private:
    LogRedecoder& redecoder_;
  };

  void OnWire(std::string_view bus, Bytes message);
  void OnSpoken(const std::string& channel, Bytes message);
  [[nodiscard]] bool IsWanted(const BusConfig* bus) const;
  [[nodiscard]] bool IsCaptured(std::string_view device) const;

  const MachineConfig& machine_;
  const std::string only_bus_;
  Output output_;
  Speech speech_;
  std::map<std::string, std::unique_ptr<BusRedecoder>> buses_;
  RecordingDiff diff_;
  std::int64_t utime_ = 0;
  std::int64_t number_ = 0;
  std::int64_t malformed_ = 0;
};

// What decoding a log again has shown: by bus what was read and where the capture has gaps; with `diff` also the
// comparison with the readings in the log.
[[nodiscard]] nlohmann::ordered_json ToJson(const LogRedecoder& redecoder, bool diff);
[[nodiscard]] std::string ToText(const LogRedecoder& redecoder, bool diff);

}  // namespace axlecast
