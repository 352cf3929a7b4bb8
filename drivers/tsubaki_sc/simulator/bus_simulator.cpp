#include "drivers/tsubaki_sc/simulator/bus_simulator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

using Kind = SimulatedFault::Kind;

constexpr std::int64_t kBitsPerCharacter = 11;  // start, 8 data, even parity, stop: guideline 2
constexpr std::int64_t kBitsPerSecond = 9600;
constexpr MonoNs kSilentInterval = 5 * kMillisecond;  // guideline 4, note 1
constexpr MonoNs kCommandPause = 100 * kMillisecond;  // guideline 3
constexpr MonoNs kLook = kSecond;                     // the interval at which the units advance without a request
constexpr std::size_t kLongestFrame = 256;
constexpr std::size_t kShortestFrame = 4;

bool ErrorCheckFits(Bytes frame) {
  const std::uint16_t check = ErrorCheck(frame.first(frame.size() - 2));
  return frame[frame.size() - 2] == (check & 0xFFU) && frame[frame.size() - 1] == check >> 8U;
}

// How strict the line is.
struct LineRules {
  // The interval that must be at least 0.1 s; guideline 3 does not define it.
  enum class Reading : std::uint8_t {
    kA,     // on the whole bus, from the end of the response
    kL,     // on the whole bus, from the end of the command
    kW,     // of each unit for itself, from the end of its response
    kNone,  // not at all
  };
  Reading reading = Reading::kA;
  bool paced = true;                      // false: no wire time, and a command ends with its last byte
  MonoNs reply_delay = 5 * kMillisecond;  // between command and response, at least the silent interval
  MonoNs tolerance = 2 * kMillisecond;    // of reading L: how late the host's bytes may reach us
  bool echo = false;                      // the adapter receives its own transmission
};

// One unit on the bus.
struct Station : ScriptedDevice<SimulatedUnit> {
  std::uint8_t address = 1;
  SeededRandom random;       // of its faults
  MonoNs ready = INT64_MIN;  // reading W

  struct Counters {
    std::int64_t commands = 0;  // carried out or refused, broadcasts too
    std::int64_t broadcasts = 0;
    std::int64_t writes = 0;               // that would change something, carried out or refused
    std::int64_t responses = 0;            // handed to the line, damaged or not
    std::array<std::int64_t, 5> errors{};  // answered, by error code
    std::int64_t dropped_early = 0;        // sooner than 0.1 s
    std::int64_t dropped_line = 0;         // damaged on its way to this unit
    std::int64_t unanswered = 0;           // off, or by a fault
  };
  Counters counters = {};
};

// Up to 16 SC units on one RS-485 line, 9600 8E1, as strict as guideline 3 and 4. A command ends after 5 ms of silence.
// Its response is handed over when its last bit would end on the wire. Time must not run backwards.
class BusSimulator final : public UnitSimulator<Station> {
 public:
  BusSimulator(std::vector<Station> stations, const LineRules& rules)
      : UnitSimulator(std::move(stations)), rules_(rules) {}

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override {
    OnDue(now, transmit);
    const bool echo = std::any_of(units().begin(), units().end(),
                                  [](const Station& s) { return s.device.fault.line.kind == Kind::kEcho; });
    if (rules_.echo || echo) transmit(bytes);
    if (!baud_fits_) {
      ++counters_.dropped_baud;
      return;
    }
    if (frame_.empty()) BeginFrame(now);
    // One byte above the maximum marks a frame as too long.
    const std::size_t room = kLongestFrame + 1 - frame_.size();
    const Bytes kept = bytes.first(std::min(room, bytes.size()));
    frame_.insert(frame_.end(), kept.begin(), kept.end());
    frame_at_.last = std::max(now, frame_at_.last) + WireTime(bytes.size());
    frame_ends_ = frame_at_.last + kSilentInterval;
    if (Collide(frame_at_)) collided_ = true;
    if (!rules_.paced && CommandLength(frame_) == frame_.size()) FinishFrame(now, transmit);
  }
  void OnBaud(std::int64_t baud) override { baud_fits_ = baud == 9600; }
  [[nodiscard]] MonoNs NextDue() const override {
    MonoNs due = std::min({UnitSimulator::NextDue(), next_look_, frame_ends_});
    for (const Response& response : responses_) due = std::min(due, response.due);
    return due;
  }
  void OnDue(MonoNs now, const Transmit& transmit) override {
    if (frame_ends_ <= now) FinishFrame(frame_ends_, transmit);
    CatchUp(now);
    SendDue(now, transmit);
  }

  // What no unit executed, since the start.
  struct Counters {
    std::int64_t dropped_gap = 0;       // a command that stopped half-way for 5 ms or longer
    std::int64_t dropped_checksum = 0;  // error check mismatch
    std::int64_t dropped_silence = 0;   // less than 5 ms after the frame before it, or run together with another
    std::int64_t dropped_baud = 0;      // bytes at another rate
    std::int64_t foreign = 0;           // for an address that no unit has
    std::int64_t collisions = 0;        // two transmitted at once
  };

 private:
  struct Response {
    Interval on_wire;
    MonoNs due = 0;  // the host gets it
    std::vector<std::uint8_t> bytes;
  };

  void CatchUp(MonoNs now) override {
    UnitSimulator::CatchUp(now);
    next_look_ = now + kLook;
  }
  [[nodiscard]] CounterList CountersOf(const Station& station) const override {
    const Station::Counters& own = station.counters;
    return {{"address", station.address},
            {"commands", own.commands},
            {"broadcasts", own.broadcasts},
            {"writes", own.writes},
            {"responses", own.responses},
            {"errors_01", own.errors[1]},
            {"errors_02", own.errors[2]},
            {"errors_03", own.errors[3]},
            {"errors_04", own.errors[4]},
            {"dropped_early", own.dropped_early},
            {"dropped_line", own.dropped_line},
            {"unanswered", own.unanswered},
            {"bus_dropped_gap", counters_.dropped_gap},
            {"bus_dropped_checksum", counters_.dropped_checksum},
            {"bus_dropped_silence", counters_.dropped_silence},
            {"bus_dropped_baud", counters_.dropped_baud},
            {"bus_foreign", counters_.foreign},
            {"bus_collisions", counters_.collisions}};
  }
  [[nodiscard]] MonoNs WireTime(std::size_t bytes) const {
    return rules_.paced ? static_cast<MonoNs>(bytes) * kBitsPerCharacter * kSecond / kBitsPerSecond : 0;
  }
  void BeginFrame(MonoNs now) {
    MonoNs quiet_since = quiet_since_;
    for (const Response& response : responses_) {  // those that the adapter still holds back
      if (response.on_wire.last <= now) quiet_since = std::max(quiet_since, response.on_wire.last);
    }
    frame_at_ = {now, now};
    run_together_ = rules_.paced && now - quiet_since < kSilentInterval;
    collided_ = false;
  }
  void FinishFrame(MonoNs now, const Transmit& transmit) {
    frame_ends_ = kNever;
    quiet_since_ = std::max(quiet_since_, frame_at_.last);
    CatchUp(now);
    if (!CountBroken()) Take(frame_, now, transmit);
    frame_.clear();
  }
  // Guideline 4, "No response". Returns true if the frame gets no response.
  [[nodiscard]] bool CountBroken() {
    if (collided_) return true;  // counted already
    const std::size_t expected = CommandLength(frame_);
    const bool cut = frame_.size() < std::max(expected, kShortestFrame);
    const bool fits = !cut && frame_.size() <= kLongestFrame && ErrorCheckFits(frame_);
    const bool two = !cut && !fits && expected != 0 && ErrorCheckFits(Bytes(frame_).first(expected));
    if (run_together_ || two) {
      ++counters_.dropped_silence;
    } else if (cut) {
      ++counters_.dropped_gap;
    } else if (!fits) {
      ++counters_.dropped_checksum;
    }
    return run_together_ || !fits;
  }
  void Take(Bytes frame, MonoNs now, const Transmit& transmit) {
    const std::uint8_t address = frame[0];
    // The pause after a command that is dropped or not answered counts from the end of the command.
    const MonoNs tolerance = rules_.reading == LineRules::Reading::kL ? rules_.tolerance : 0;
    bool anybody = address == 0;
    for (Station& station : units()) {
      if (address != 0 && station.address != address) continue;
      anybody = true;
      const bool early = TooEarly(station);
      station.ready = frame_at_.last + kCommandPause;
      if (early) {
        ++station.counters.dropped_early;
      } else {
        Offer(station, frame, now, transmit);
      }
    }
    if (!anybody) ++counters_.foreign;
    ready_ = std::max(ready_, frame_at_.last + kCommandPause - tolerance);
    if (rules_.reading != LineRules::Reading::kA) return;
    for (const Response& response : responses_) ready_ = std::max(ready_, response.on_wire.last + kCommandPause);
  }
  [[nodiscard]] bool TooEarly(const Station& station) const {
    using Reading = LineRules::Reading;
    if (rules_.reading == Reading::kNone) return false;
    return frame_at_.first < (rules_.reading == Reading::kW ? station.ready : ready_);
  }
  void Offer(Station& station, Bytes frame, MonoNs now, const Transmit& transmit) {
    const UnitFault& fault = station.device.fault;
    if (!station.device.unit.powered() || fault.line.kind == Kind::kOff) {
      ++station.counters.unanswered;
      return;
    }
    if (fault.line.kind == Kind::kRequestFlip) {
      std::vector<std::uint8_t> heard(frame.begin(), frame.end());
      const bool hit = FlipBits(heard, 9, fault.line.amount, station.random);
      // Parity and error check detect it.
      if (hit || !std::equal(heard.begin(), heard.end(), frame.begin())) {
        ++station.counters.dropped_line;
        return;
      }
    }
    const bool broadcast = frame[0] == 0;
    const Bytes command = frame.subspan(1, frame.size() - 3);
    if (broadcast && !IsWrite(command[0])) return;
    ++station.counters.commands;
    if (broadcast) ++station.counters.broadcasts;
    if (IsWrite(command[0])) ++station.counters.writes;
    std::vector<std::uint8_t> response =
        fault.exception != 0 ? ErrorResponse(command[0], fault.exception) : Execute(station.device.unit, command);
    if (broadcast) return;
    if ((response[0] & 0x80U) != 0 && response[1] < station.counters.errors.size()) {
      ++station.counters.errors.at(response[1]);
    }
    if (fault.line.kind == Kind::kIntermittent && station.random.Share() < fault.line.amount) {
      ++station.counters.unanswered;
      return;
    }
    Respond(station, std::move(response), now, transmit);
  }
  void Respond(Station& station, std::vector<std::uint8_t> bytes, MonoNs now, const Transmit& transmit) {
    const UnitFault& fault = station.device.fault;
    bytes.insert(bytes.begin(), fault.wrong_address != 0 ? fault.wrong_address : station.address);
    const std::uint16_t check = ErrorCheck(bytes);
    bytes.push_back(static_cast<std::uint8_t>(check));
    bytes.push_back(static_cast<std::uint8_t>(check >> 8U));
    const MonoNs later = fault.line.kind == Kind::kSlow ? std::llround(fault.line.amount * 1e3) : 0;
    Response response;
    response.on_wire.first = (rules_.paced ? frame_at_.last + rules_.reply_delay : now) + later;
    response.on_wire.last = response.on_wire.first + WireTime(bytes.size());
    response.due = adapter_.Due(response.on_wire.last, fault.line, station.random);
    station.ready = response.on_wire.last + kCommandPause;
    bytes.resize(Damage(bytes, fault.line, station.random));
    response.bytes = std::move(bytes);
    ++station.counters.responses;
    if (Collide(response.on_wire)) return;
    responses_.push_back(std::move(response));
    SendDue(now, transmit);
  }
  // Destroys the responses that are on the wire within the interval. Returns whether there was one.
  bool Collide(const Interval& with) {
    const std::size_t hit = std::erase_if(responses_, [&](const Response& response) {
      return response.on_wire.first < with.last && with.first < response.on_wire.last;
    });
    counters_.collisions += hit == 0 ? 0 : 1;
    return hit != 0;
  }
  void SendDue(MonoNs now, const Transmit& transmit) {
    while (!responses_.empty()) {
      const auto first = std::min_element(responses_.begin(), responses_.end(),
                                          [](const Response& a, const Response& b) { return a.due < b.due; });
      if (first->due > now) return;
      const Response response = std::move(*first);
      responses_.erase(first);
      quiet_since_ = std::max(quiet_since_, response.on_wire.last);
      if (!response.bytes.empty()) transmit(response.bytes);
    }
  }

  LineRules rules_;
  Counters counters_;
  bool baud_fits_ = true;
  MonoNs next_look_ = 0;

  std::vector<std::uint8_t> frame_;  // of the command so far
  Interval frame_at_;                // on the wire
  MonoNs frame_ends_ = kNever;       // it is complete if no byte comes before
  bool run_together_ = false;        // without silence before it
  bool collided_ = false;
  MonoNs quiet_since_ = INT64_MIN / 2;
  MonoNs ready_ = INT64_MIN;  // readings A and L
  std::vector<Response> responses_;
  LateAdapter adapter_;
};

// The key of the whole bus; the other keys are units.
constexpr std::string_view kTiming = "timing";

MonoNs Milliseconds(ConfigMap& map, std::string_view key, MonoNs usual, double min, double max) {
  const double number = map.Number(key, static_cast<double>(usual) / kMillisecond, min, max, "ms");
  return std::llround(number * kMillisecond);
}

LineRules ReadRules(ConfigMap map, bool echo) {
  LineRules rules;
  rules.reading = static_cast<LineRules::Reading>(map.Choice("reading", {"A", "L", "W", "none"}, 0));
  rules.paced = map.Choice("pace", {"wire", "unpaced"}, 0) == 0;
  rules.reply_delay = Milliseconds(map, "reply_delay_ms", rules.reply_delay, 5, 1000);
  rules.tolerance = Milliseconds(map, "tolerance_ms", rules.tolerance, 0, 50);
  rules.echo = echo;
  map.Done();
  return rules;
}

Station ReadStation(ConfigMap map, const std::string& name, std::uint8_t address) {
  const auto seed = static_cast<std::uint64_t>(map.Integer("seed", address, 0, INT64_MAX, ""));
  const SimulatedUnit unit(seed);
  SimulatedUnit started = unit;
  started.Advance(0);  // a script may trip the motor, so the motor must run
  return {{name, unit, ReadScriptOf(map, started)}, address, SeededRandom(seed)};
}

}  // namespace
}  // namespace axlecast::tsubaki_sc::simulator

namespace axlecast::tsubaki_sc {

std::unique_ptr<Simulator> MakeSimulator(const BusConfig& bus, ConfigMap& simulate,
                                         std::span<const std::pair<std::string, std::uint8_t>> units) {
  const std::size_t errors = simulate.errors().list().size();
  using namespace simulator;
  const LineRules rules = ReadRules(simulate.Map(kTiming), bus.link.echo);
  std::vector<Station> stations;
  for (const auto& [name, address] : units) {
    if (name == kTiming) {
      simulate.Error(name, "is the line's timing here: a unit with this name cannot be simulated");
      continue;
    }
    stations.push_back(ReadStation(simulate.Named(name), name, address));
  }
  if (stations.empty() || simulate.errors().list().size() != errors) return nullptr;
  return std::make_unique<BusSimulator>(std::move(stations), rules);
}

}  // namespace axlecast::tsubaki_sc
