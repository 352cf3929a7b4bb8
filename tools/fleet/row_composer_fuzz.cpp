// Hostile events: messages of every type with changed bytes, any bytes as messages, and any channels. Every event must be counted
// once, every chunk and every raw row must be decodable, every time must be in the range, and every JSON must be JSON.
#include <algorithm>
#include <array>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/text.h"
#include "tools/fleet/position_chunk.h"
#include "tools/fleet/raw_records.h"
#include "tools/fleet/row_fixture.h"

namespace {

using namespace axlecast;

void Require(bool holds) {
  if (!holds) std::abort();
}

// A channel, and a message of its type.
struct Pattern {
  std::string channel;
  std::vector<std::uint8_t> message;
};

template <typename Message>
Pattern Of(const std::string& channel) {
  return {channel, Encoded(MessageAt<Message>(kT0, 1))};
}

std::vector<std::uint8_t> SomeBlock() {
  auto block = MessageAt<position_block_t>(kT0, 0);
  block.n = 3;
  block.dt_ns = {0, 1'000, 2'000};
  block.time_uncertainty_ns = {0, 0, 0};
  block.counts = {0, 1, 2};
  block.flags = {1, 1, 0};
  return Encoded(block);
}

std::vector<std::uint8_t> SomeCommand() {
  command_body_t body{};
  body.device = "axis1";
  auto command = MessageAt<command_t>(kT0, 0);
  command.body = Encoded(body);
  command.body_size = static_cast<std::int16_t>(command.body.size());
  return Encoded(command);
}

const std::vector<Pattern>& Patterns() {
  static const std::vector<Pattern> patterns{
      {"POSITION/axis1", Encoded(PositionAt(0))},
      {"POSITION/axis2", Encoded(PositionAt(1))},
      {"POSITION/full", Encoded(PositionAt(1))},
      {"POSITION/dead", Encoded(PositionAt(1))},
      {"POSITION/rollup", Encoded(PositionAt(1))},
      {"POSITION_BLOCK/block", SomeBlock()},
      {"ALARM/axis1", Encoded(AlarmsAt(kT0, 1, {Alarm(7, kT0), Alarm(8, kT0)}))},
      Of<command_status_t>("COMMAND_STATUS"),
      {"COMMAND", SomeCommand()},
      Of<trip_log_t>("TRIP/motor1"),
      Of<device_info_t>("DEVICE/axis1"),
      Of<bus_health_t>("BUS/line1"),
      Of<recorder_health_t>("RECORDER/all"),
      Of<motor_health_t>("MOTOR/motor1"),
      Of<time_quality_t>("TIME/host1"),
      {"WIRE/line1", {}},
      {std::string(kMachineChannel), {}},
      {std::string(kSealChannel), {}}};
  return patterns;
}

RowComposer NewComposer() {
  LogFacts facts = PressFacts();
  for (const char* device : {"full", "dead", "block"}) facts.devices[device] = facts.devices["axis1"];
  facts.devices["block"].block = true;
  return {facts, "all",
          Rules({{"/full$", {.detail = Detail::kFull, .raw = true}},
                 {"/dead$", {.detail = Detail::kDeadband, .deadband = 0.01}},
                 {"/rollup$", {.detail = Detail::kRollup}},
                 {"^WIRE", {.detail = Detail::kNone, .raw = true}}}),
          kThisYear};
}

// Takes the input apart, from its begin.
class Input {
 public:
  explicit Input(Bytes data) : data_(data) {}
  [[nodiscard]] bool empty() const { return data_.empty(); }
  std::uint8_t Byte() {
    if (data_.empty()) return 0;
    const std::uint8_t byte = data_[0];
    data_ = data_.subspan(1);
    return byte;
  }
  Bytes Some(std::size_t size) {
    const Bytes some = data_.first(std::min(size, data_.size()));
    data_ = data_.subspan(some.size());
    return some;
  }

 private:
  Bytes data_;
};

void RequireText(const std::string& text) {
  Require(MendedUtf8(text) == text && text.find('\0') == std::string::npos);
}

template <typename Row>
void RequireRows(const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    Require(kThisYear.Contains(row.t));
    RequireText(row.message);
    Require(nlohmann::json::accept(row.message));
    Require(row.message.find("\\u0000") == std::string::npos || row.message.find("\\\\u0000") != std::string::npos);
  }
}

void RequireSound(const BatchRows& rows) {
  std::int64_t samples = 0;
  for (const PositionChunkRow& chunk : rows.chunks) {
    const auto decoded = DecodePositionChunk(chunk, rows.streams.at(chunk.stream));
    Require(decoded.has_value());
    Require(decoded->front().counts == chunk.first && decoded->back().utime == chunk.t1);
    Require(kThisYear.Contains(chunk.t0) && kThisYear.Contains(chunk.t1) && chunk.t0 <= chunk.t1);
    Require(chunk.summary.valid == 0 ? !chunk.summary.lo : *chunk.summary.lo <= *chunk.summary.hi);
    samples += chunk.summary.n;
  }
  Require(samples == rows.samples);
  for (const RollUpRow& row : rows.seconds) Require(row.t % 1'000'000 == 0 && row.stream < rows.streams.size());
  for (const RollUpRow& row : rows.minutes) Require(row.t % 60'000'000 == 0 && row.stream < rows.streams.size());
  for (const RawRow& raw : rows.raw) Require(DecodeRaw(raw).has_value());
  RequireRows(rows.alarms);
  RequireRows(rows.commands);
  RequireRows(rows.trips);
  RequireRows(rows.devices);
  RequireRows(rows.buses);
  RequireRows(rows.recorders);
  RequireRows(rows.motors);
  RequireRows(rows.clocks);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  RowComposer composer = NewComposer();
  Input input(Bytes(data, size));
  std::int64_t events = 0;
  std::int64_t counted = 0;
  std::vector<std::uint8_t> message;
  while (!input.empty()) {
    const std::uint8_t kind = input.Byte();
    if (kind == 0xFF) {
      const BatchRows rows = composer.Take();
      RequireSound(rows);
      counted += rows.counts.Total();
      continue;
    }
    std::string channel;
    message.clear();
    if (kind >= 0xF0) {  // any channel, any bytes
      channel = std::string(AsText(input.Some(kind & 0xFU)));
      if (channel.empty()) channel = "x";
      std::replace(channel.begin(), channel.end(), '\0', '0');
      const Bytes some = input.Some(input.Byte());
      message.assign(some.begin(), some.end());
    } else {
      const Pattern& pattern = Patterns()[kind % Patterns().size()];
      channel = pattern.channel;
      message = pattern.message;
      // Bytes behind the fingerprint are replaced: the place and the number are of the input.
      for (std::size_t changes = input.Byte() % 8U; changes > 0; --changes) {
        const std::size_t at = 8 + (std::size_t{input.Byte()} | std::size_t{input.Byte()} << 8U) % 700U;
        for (const std::uint8_t byte : input.Some(1 + input.Byte() % 8U)) {
          if (message.size() > at) message[at] = byte;
        }
      }
    }
    composer.Add({.number = events++, .utime = kT0 + events, .channel = channel, .data = message});
  }
  const BatchRows rows = composer.Take();
  RequireSound(rows);
  Require(counted + rows.counts.Total() == events);
  return 0;
}
