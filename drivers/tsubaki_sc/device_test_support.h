#pragma once

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/tsubaki_sc/family.h"
#include "drivers/tsubaki_sc/settings.h"
#include "drivers/tsubaki_sc/unit_test_support.h"
#include "tests/support/recording_output.h"

namespace axlecast::tsubaki_sc {

// Passwords by their file.
class TestSecrets final : public SecretSource {
 public:
  [[nodiscard]] Result<Secret> Read(const SecretPlace& place) override {
    ++reads;
    const auto found = files.find(place.file);
    if (found == files.end()) return Failure(place.file + " cannot be read: No such file or directory");
    return Secret(found->second);
  }
  std::map<std::string, std::string> files = {{"/p/old", "password"}, {"/p/new", "New-Secret~16chr"}};
  int reads = 0;
};

class BenchOutput final : public RecordingOutput {
 public:
  void OnIdentity(std::int64_t its, std::string_view number, std::string_view version) override {
    identity = its;
    serial = number;
    firmware = version;
  }
  void OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs) override { alarm_states[alarm.name] = state; }
  [[nodiscard]] AlarmState State(const std::string& name) const {
    const auto found = alarm_states.find(name);
    return found == alarm_states.end() ? AlarmState::kAbsent : found->second;
  }
  [[nodiscard]] int Errors(ErrorKind kind) const {
    return static_cast<int>(
        std::count_if(errors.begin(), errors.end(), [&](const auto& error) { return error.first == kind; }));
  }
  std::string serial;
  std::string firmware;
  std::map<std::string, AlarmState> alarm_states;
};

inline constexpr const char* kPlainKeys = "{address: 1}";
inline constexpr const char* kFullKeys =
    "{address: 1, motor_control: start_stop, passwords: {old: {file: /p/old}, new: {file: /p/new}}, password: old}";
inline constexpr const char* kKeptKeys =
    "{address: 1, passwords: {old: {file: /p/old}, new: {file: /p/new}}, password: old, log_out: false}";
inline constexpr const char* kLoginKeys =
    "{address: 1, passwords: {old: {file: /p/old}, new: {file: /p/new}}, password: old}";

// A device with its unit on a wire at 9600 8E1 in virtual time, alone on a bus paced by reading A. One slot in 128
// belongs to the slow items, as in drivers/runtime/bus/schedule.h.
class DeviceFixture {
 public:
  struct Sent {
    MonoNs at;
    ByteList request;
    Priority priority;
    bool secret;
  };
  // Returns the reply to a request; may use the reply of the unit.
  using Wire = std::function<ByteList(const ByteList& request)>;

  explicit DeviceFixture(const std::string& keys = kPlainKeys, double poll_hz = 0) : errors_("test.yaml") {
    bus_.poll_hz = poll_hz;
    bus_.link.line = kUnitLine;
    bus_.family_bus = std::make_shared<ScBus>();
    ConfigMap map(YAML::Load(keys), "gm1", errors_);
    config_.settings = ParseSettings(map, bus_);
    map.Done();
    EXPECT_TRUE(errors_.empty()) << errors_.Text();
    device = MakeDevice(bus_, config_, output, secrets);
  }

  void LinkUp() { Tell(Event::Kind::kLinkUp); }
  void LinkDown() { Tell(Event::Kind::kLinkDown); }
  void Stray(const ByteList& bytes) { Tell(Event::Kind::kUnexpectedBytes, bytes); }

  // Returns the next step, without executing it.
  [[nodiscard]] Step Peek(bool poll_due = true, bool reserved = false) const {
    return device->Next({.now = now, .poll_due = poll_due, .reserved = reserved});
  }
  [[nodiscard]] ByteList Offered(bool poll_due = true) const {
    const Step step = Peek(poll_due);
    const auto* exchange = std::get_if<Exchange>(&step.action);
    if (exchange == nullptr) return {};
    const Bytes request = exchange->request;
    return {request.begin(), request.end()};
  }

  // One slot of the bus; `reserved`: closed to commands. Returns false if the device is idle.
  bool BusSlot(bool poll_due = true, bool reserved = false) {
    const Step step = Peek(poll_due, reserved);
    if (const auto* silence = std::get_if<WaitForIdleLine>(&step.action)) {
      device->OnStarted(step, now);
      now += silence->quiet;
      Tell(Event::Kind::kSilent);
      return true;
    }
    if (const auto* exchange = std::get_if<Exchange>(&step.action)) {
      device->OnStarted(step, now);
      Carry(*exchange, step.priority);
      return true;
    }
    return false;
  }
  // Slots as the schedule gives them on a full bus.
  void Turns(int count) {
    for (int i = 0; i < count; ++i) {
      const bool reserved = turns_++ % 128 == 127;
      if (!reserved || !BusSlot(false)) BusSlot(true);
    }
  }
  void RunUntil(const std::function<bool()>& done, int maximum = 2000) {
    for (int i = 0; i < maximum && !done(); ++i) Turns(1);
    EXPECT_TRUE(done()) << "not reached in " << maximum << " turns";
  }
  // Online and looked at in full.
  void GoOnline() {
    LinkUp();
    RunUntil([&] { return !output.motors.empty() && !output.firmware.empty() && Ready(); });
    constexpr std::uint8_t kStatusAddress = 200;
    if (Offered()[3] == kStatusAddress) Turns(1);  // so that a live cycle begins
    sent.clear();
    output.motors.clear();
  }

  void Begin(const std::string& operation, std::vector<std::pair<std::string, std::string>> arguments = {},
             MonoNs begin_by = kNever) {
    DriverCommand order;
    order.id = {++orders_};
    order.operation = operation;
    order.arguments = std::move(arguments);
    order.begin_by = begin_by;
    last_id = order.id;
    device->Begin(order, now);
  }
  // Begins it and continues until its final outcome.
  const Outcome& Do(const std::string& operation, std::vector<std::pair<std::string, std::string>> arguments = {}) {
    const std::size_t before = Finals();
    Begin(operation, std::move(arguments));
    RunUntil([&] { return Finals() > before; });
    return Last();
  }
  [[nodiscard]] const Outcome& Last() const {
    static const Outcome none;
    return output.outcomes.empty() ? none : output.outcomes.back().second;
  }
  [[nodiscard]] std::size_t Finals() const {
    return static_cast<std::size_t>(std::count_if(output.outcomes.begin(), output.outcomes.end(),
                                                  [](const auto& one) { return one.second.IsFinal(); }));
  }
  // Requests sent that begin so, after the address.
  [[nodiscard]] int Count(const ByteList& begin) const {
    return static_cast<int>(std::count_if(sent.begin(), sent.end(), [&](const Sent& one) {
      return one.request.size() > begin.size() && std::equal(begin.begin(), begin.end(), one.request.begin() + 1);
    }));
  }

  TestUnit unit;
  Wire wire = [this](const ByteList& request) { return unit.Answer(request); };
  TestSecrets secrets;
  BenchOutput output;
  std::unique_ptr<Device> device;
  MonoNs now = 1000 * kSecond;
  std::vector<Sent> sent;
  CommandId last_id{};

 private:
  [[nodiscard]] bool Ready() const {
    constexpr std::size_t kReadLast = 19;  // a parameter of the last slow item
    return output.motors.back().mains_hz != 0 && output.motors.back().logged_in >= 0 && !output.limits.empty() &&
           !std::isnan(output.limits.back().parameters[kReadLast]);
  }

  void Carry(const Exchange& exchange, Priority priority) {
    const Bytes bytes = exchange.request;
    const ByteList request(bytes.begin(), bytes.end());
    sent.push_back({now, request, priority, exchange.secret});
    Event event{.kind = Event::Kind::kTimeout, .sent = {now, now}, .received = {}, .request = bytes, .bytes = {}};
    const MonoNs end_of_request = now + kUnitLine.WireTime(request.size());
    const ByteList reply = wire(request);
    const std::size_t length = reply.empty() ? 0 : exchange.reply_length(reply);
    if (!reply.empty()) {
      const MonoNs first = end_of_request + kSilentInterval + kUnitLine.WireTime(1);
      event.received = {first, end_of_request + kSilentInterval + kUnitLine.WireTime(reply.size())};
      event.bytes = reply;
    }
    const bool whole = length != 0 && reply.size() >= length;
    if (whole) {
      event.kind = Event::Kind::kReply;
      event.bytes = Bytes(reply).first(length);
    } else if (reply.empty()) {
      event.received = {now + exchange.timeout, now + exchange.timeout};
    }
    now = whole ? event.received.last : now + exchange.timeout;
    device->On(event);
    now += kCommandPause;
  }

  void Tell(Event::Kind kind, const ByteList& bytes = {}) {
    device->On({.kind = kind, .sent = {}, .received = {now, now}, .request = {}, .bytes = bytes});
  }

  ConfigErrors errors_;
  BusConfig bus_;
  DeviceConfig config_;
  std::uint8_t orders_ = 0;
  int turns_ = 0;
};

}  // namespace axlecast::tsubaki_sc
