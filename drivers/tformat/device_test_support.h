#pragma once

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/family.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

using ByteList = std::vector<std::uint8_t>;

// Requests as TS5669 spec Table 1 gives their bits.
inline const ByteList kId0 = {0x02};
inline const ByteList kId1 = {0x8A};
inline const ByteList kId2 = {0x92};
inline const ByteList kId3 = {0x1A};
inline const ByteList kId7 = {0xBA};
inline const ByteList kId8 = {0xC2};
inline const ByteList kIdC = {0x62};

// Appends the CRC: the XOR of all bytes, written down here once more on its own.
inline ByteList Checked(ByteList bytes) {
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : bytes) sum = static_cast<std::uint8_t>(sum ^ byte);
  bytes.push_back(sum);
  return bytes;
}

struct AllFields {
  std::uint32_t single_turn = 42405;
  std::uint32_t turns = 3;
  std::uint8_t alarms = 0;
  std::optional<std::uint8_t> status = {};  // nothing: as the alarms require
  std::uint8_t encoder_id = 0x11;
};

inline std::uint8_t Byte(std::uint32_t value, int index) { return static_cast<std::uint8_t>(value >> (8 * index)); }

// Spec 6.3.2 (3): ea0 is CE, ea1 is ME, BE or BA.
inline std::uint8_t StatusFor(std::uint8_t alarms) {
  return static_cast<std::uint8_t>(((alarms & 0x04) != 0 ? 0x10 : 0) | ((alarms & 0xE0) != 0 ? 0x20 : 0));
}

inline ByteList All(const AllFields& f = {}) {
  return Checked({0x1A, f.status.value_or(StatusFor(f.alarms)), Byte(f.single_turn, 0), Byte(f.single_turn, 1),
                  Byte(f.single_turn, 2), f.encoder_id, Byte(f.turns, 0), Byte(f.turns, 1), Byte(f.turns, 2),
                  f.alarms});
}

// The reply with three data bytes, to ID 0 or a reset.
inline ByteList Short(const ByteList& request, std::uint32_t value = 42405, std::uint8_t status = 0) {
  return Checked({request.at(0), status, Byte(value, 0), Byte(value, 1), Byte(value, 2)});
}

inline ByteList Cell(std::uint8_t address, std::uint8_t data) { return Checked({0xEA, address, data}); }
inline ByteList CellBusy(std::uint8_t address) {
  return Checked({0xEA, static_cast<std::uint8_t>(address | 0x80), 0});
}

class RecordingOutput final : public DeviceOutput {
 public:
  void OnSample(const Sample& sample) override { samples.push_back(sample); }
  void OnMotor(const MotorReading&) override { ++monitor_readings; }
  void OnTrip(const TripRecord&) override { ++monitor_readings; }
  void OnError(ErrorKind kind, Interval) override { ++errors[kind]; }
  void OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs) override {
    alarms[alarm.name] = state;
    if (state != AlarmState::kAbsent) alarm_specs.insert_or_assign(alarm.name, alarm);
  }
  void OnIdentity(std::int64_t id, std::string_view, std::string_view) override { identities.push_back(id); }
  void OnStarting(std::string_view) override { ++starting; }
  void OnRefused(std::string_view reason) override { refusals.emplace_back(reason); }
  void OnNonVolatileWrite() override { ++non_volatile_writes; }
  void OnReferenceLost() override { ++references_lost; }
  void OnReferenceRestored() override { ++references_restored; }
  void OnJump() override { ++jumps; }
  void OnDatumChanging(bool changing) override { datum_changing.push_back(changing); }
  void OnOutcome(const CommandId&, const Outcome& outcome) override { outcomes.push_back(outcome); }
  [[nodiscard]] Motion MotionAt(MonoNs now) const override { return motion(now); }

  [[nodiscard]] bool Present(const std::string& alarm) const {
    const auto found = alarms.find(alarm);
    return found != alarms.end() && found->second != AlarmState::kAbsent;
  }
  [[nodiscard]] int AllErrors() const {
    int sum = 0;
    for (const auto& [kind, count] : errors) sum += count;
    return sum;
  }

  std::vector<Sample> samples;
  std::map<ErrorKind, int> errors;
  std::map<std::string, AlarmState> alarms;
  std::map<std::string, AlarmSpec> alarm_specs;  // of those that were up
  std::vector<std::int64_t> identities;
  std::vector<std::string> refusals;
  std::vector<bool> datum_changing;
  std::vector<Outcome> outcomes;
  int monitor_readings = 0;  // an encoder gives none
  int starting = 0;
  int non_volatile_writes = 0;
  int references_lost = 0;
  int references_restored = 0;
  int jumps = 0;
  std::function<Motion(MonoNs)> motion = [](MonoNs) { return Motion{.known = true, .standstill = true}; };
};

// A device whose bus is played by hand. Time moves only when the test moves it; every exchange takes 60 us.
class DeviceFixture {
 public:
  static constexpr MonoNs kExchange = 60 * kMicrosecond;

  explicit DeviceFixture(const std::string& keys = "{model: ts5669n127}", bool echo = false, bool simulate = false)
      : errors_("test.yaml") {
    ConfigMap map(YAML::Load(keys), "axis1", errors_);
    config_.settings = ParseSettings(map, {.baud = 2'500'000});
    map.Done();
    EXPECT_TRUE(errors_.empty()) << errors_.Text();
    bus_.link.line.baud = 2'500'000;
    bus_.link.echo = echo;
    bus_.simulate = simulate;
    device = MakeDevice(bus_, config_, output);
  }

  [[nodiscard]] const TFormatSettings& settings() const {
    return static_cast<const TFormatSettings&>(*config_.settings);
  }
  [[nodiscard]] const BusConfig& bus() const { return bus_; }
  [[nodiscard]] const DeviceConfig& config() const { return config_; }

  [[nodiscard]] Step Next(bool poll_due = true) const { return device->Next({.now = now, .poll_due = poll_due}); }
  [[nodiscard]] bool IsIdle(bool poll_due = true) const {
    return std::holds_alternative<Idle>(Next(poll_due).action);
  }
  [[nodiscard]] MonoNs IdleUntil(bool poll_due = false) const {
    return std::get<Idle>(Next(poll_due).action).until;
  }
  [[nodiscard]] bool IsSilence() const { return std::holds_alternative<WaitForIdleLine>(Next().action); }
  // Returns the pending request; nothing if there is no request.
  [[nodiscard]] ByteList Offered(bool poll_due = true) const {
    const Step step = Next(poll_due);
    const auto* exchange = std::get_if<Exchange>(&step.action);
    if (exchange == nullptr) return {};
    const Bytes request = exchange->request;
    return {request.begin(), request.end()};
  }

  void LinkUp() { Event(Event::Kind::kLinkUp, {}); }
  void LinkDown() { Event(Event::Kind::kLinkDown, {}); }
  void Stray(const ByteList& bytes) { Event(Event::Kind::kUnexpectedBytes, bytes); }
  void PassSilence() {
    const Step step = Next();
    const auto* silence = std::get_if<WaitForIdleLine>(&step.action);
    ASSERT_NE(silence, nullptr) << "no silence was asked for";
    device->OnStarted(step, now);
    now += silence->quiet;
    Event(Event::Kind::kSilent, {});
  }

  // Puts the offered request on the wire and returns it.
  ByteList Start(bool poll_due = true) {
    const Step step = Next(poll_due);
    const auto* exchange = std::get_if<Exchange>(&step.action);
    if (exchange == nullptr) {
      ADD_FAILURE() << "nothing was to be transmitted";
      return {};
    }
    exchange_ = *exchange;
    device->OnStarted(step, now);
    const Bytes request = exchange_.request;
    requests.push_back({now, {request.begin(), request.end()}});
    return requests.back().second;
  }
  // The bytes that come to what Start put on the wire. Complete or not: the device's own length rule decides.
  void Finish(const ByteList& bytes) {
    axlecast::Event event{.kind = Event::Kind::kReply,
                          .sent = {now, now + 1 * kMicrosecond},
                          .received = {now + 55 * kMicrosecond, now + kExchange},
                          .request = exchange_.request,
                          .bytes = bytes};
    now += kExchange;
    const std::size_t length = bytes.empty() ? 0 : exchange_.reply_length(bytes);
    if (length == 0 || bytes.size() < length) {
      event.kind = Event::Kind::kTimeout;
      now += exchange_.timeout;
      if (bytes.empty()) event.received = {now, now};
    } else {
      event.bytes = Bytes(bytes).first(length);
    }
    device->On(event);
    if (length != 0 && bytes.size() > length)
      Stray({bytes.begin() + static_cast<std::ptrdiff_t>(length), bytes.end()});
  }
  void Give(const ByteList& request, const ByteList& reply, bool poll_due = true) {
    EXPECT_EQ(Start(poll_due), request);
    Finish(reply);
  }

  // Lets the time pass for which the device waits.
  void PassIdle() {
    if (IsIdle()) now = IdleUntil(true);
  }
  // Requests of a reset sequence with good replies, each as soon as it is offered.
  void GiveResets(const ByteList& request, int count, std::uint32_t single_turn = 42405, std::uint8_t status = 0) {
    for (int i = 0; i < count; ++i) {
      PassIdle();
      Give(request, Short(request, single_turn, status));
    }
  }

  // Online and at rest: two readings by ID 3 (the second confirms the alarms).
  void GoOnline(const AllFields& fields = {}) {
    LinkUp();
    PassSilence();
    Give(kId3, All(fields));
    Give(kId3, All(fields), false);
  }

  void Begin(const std::string& operation, std::vector<std::pair<std::string, std::string>> arguments = {},
             MonoNs begin_by = kNever) {
    DriverCommand order;
    order.id = {1, 2, 3};
    order.operation = operation;
    order.arguments = std::move(arguments);
    order.begin_by = begin_by;
    device->Begin(order, now);
  }
  [[nodiscard]] const Outcome& Last() const {
    static const Outcome none;
    EXPECT_FALSE(output.outcomes.empty());
    return output.outcomes.empty() ? none : output.outcomes.back();
  }
  [[nodiscard]] int FinalOutcomes() const {
    int count = 0;
    for (const Outcome& outcome : output.outcomes) count += outcome.IsFinal() ? 1 : 0;
    return count;
  }

  RecordingOutput output;
  std::unique_ptr<Device> device;
  MonoNs now = 100 * kSecond;
  std::vector<std::pair<MonoNs, ByteList>> requests;  // what was transmitted, and when

 private:
  void Event(Event::Kind kind, const ByteList& bytes) {
    device->On({.kind = kind, .sent = {}, .received = {now, now}, .request = {}, .bytes = bytes});
  }

  ConfigErrors errors_;
  BusConfig bus_;
  DeviceConfig config_;
  Exchange exchange_;
};

}  // namespace axlecast::tformat
