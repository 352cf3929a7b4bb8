#include "drivers/saa_serial/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/config/machine_config.h"
#include "drivers/kit/arguments.h"

namespace axlecast::saa_serial {
namespace {

using Reason = command_status_t;

// An 8-bit sum accepts one damaged frame in 256. Two consecutive readings are required, of at most five.
constexpr int kNearToSucceed = 2;
constexpr int kMaxReadings = 5;

// Returns whether an encoder that was just cleared to zero may read this position.
bool IsNearZero(std::uint32_t counts, const SaaSettings& settings) {
  return CircularDistance(counts, 0, settings.counts_per_turn) <= ZeroToleranceCounts(settings.format.bits);
}

// Clears the encoder to zero (SAA manual 5.1.2 (5), 5.1.6 (1)): a reading that shows where the shaft was, standstill
// measured once more, one pulse on CLR or one BC AA CX, and, because nothing answers these, readings that show the
// effect. The request goes out once and is never repeated.
class ZeroProcedure final : public Procedure {
 public:
  // `patience`: how long it waits for a reading, before and after.
  ZeroProcedure(const SaaSettings& settings, const DeviceOutput& output, MonoNs patience, MonoNs now)
      : settings_(settings), output_(output), patience_(patience), deadline_(now + patience) {}

  [[nodiscard]] Need Next(MonoNs now) const override {
    switch (stage_) {
      case Stage::kReadBefore:
        return Need::kReading;
      case Stage::kSend:
        return AtRest(output_, now) ? Need::kZero : Need::kReading;
      case Stage::kSent:
        return Need::kNothing;
      default:
        return now < effect_from_ ? Need::kNothing : Need::kReading;
    }
  }
  [[nodiscard]] MonoNs Due(MonoNs now) const override {
    return stage_ == Stage::kSettle && now < effect_from_ ? effect_from_ : deadline_;
  }
  std::optional<Outcome> OnReading(const Reading& reading, MonoNs now) override {
    if (stage_ == Stage::kSettle) return Verify(reading);
    if (reading.error || stage_ == Stage::kSent) return OnTime(now);
    if (!AtRest(output_, now)) return NotAtRest(output_.MotionAt(now));
    before_ = reading.counts;
    stage_ = Stage::kSend;
    return std::nullopt;
  }
  std::optional<Outcome> OnTime(MonoNs now) override {
    if (now < deadline_ || stage_ == Stage::kSent) return std::nullopt;
    if (!touched()) {
      return Final(CommandState::kRejected, Reason::REASON_NO_REPLY,
                   "nothing was done: no reading came to begin with");
    }
    return WithBefore(
        Final(
            CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
            "the request to clear to zero went out, but no reading came that shows its effect: read_position when "
            "the encoder answers again"),
        "");
  }
  void OnZeroStarted() override { stage_ = Stage::kSent; }
  std::optional<Outcome> OnZeroed(MonoNs effect_from) override {
    stage_ = Stage::kSettle;
    effect_from_ = effect_from;
    deadline_ = effect_from + patience_;
    Outcome running;
    running.text = "the request to clear to zero went out; waiting for a reading that shows its effect";
    running.progress = 0.5F;
    // If this process ends now, a later reading proves an effect only if the state before is known.
    return WithBefore(std::move(running), "");
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    if (!touched()) {
      return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
    }
    return WithBefore(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            "the link was lost after the request to clear to zero and before its effect could be "
                            "read: read_position when the link is back"),
                      "");
  }
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kSent; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kSent, kSettle };

  // A request to clear to zero is not answered. If the shaft was near 0 before, nothing shows its effect.
  [[nodiscard]] bool SameBefore() const {
    return CannotBeToldApart(before_, 0, ZeroToleranceCounts(settings_.format.bits), settings_.counts_per_turn);
  }
  [[nodiscard]] std::optional<Outcome> Verify(const Reading& reading) {
    if (reading.error || reading.at.first < effect_from_) return OnTime(reading.at.last);
    ++readings_;
    near_in_a_row_ = IsNearZero(reading.counts, settings_) ? near_in_a_row_ + 1 : 0;
    if (near_in_a_row_ < kNearToSucceed && readings_ < kMaxReadings) return OnTime(reading.at.last);
    return Evaluate(reading.counts);
  }
  [[nodiscard]] Outcome Evaluate(std::uint32_t counts) const {
    const int bits = settings_.format.bits;
    const double allowed = Degrees(ZeroToleranceCounts(bits), bits);
    const bool near = near_in_a_row_ >= kNearToSucceed;
    const std::string was =
        Text("single-turn was %.3f deg and reads %.3f deg", Degrees(before_, bits), Degrees(counts, bits));
    Outcome outcome =
        near ? ReadBackOutcome({.same_before = SameBefore()}, was + Text(" (0 +- %.2f)", allowed))
             : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                     was + Text(", not 0 +- %.2f: hold the axis; is it the variant with zero clearing, "
                                "and is its line or command right?",
                                allowed));
    return WithBefore(std::move(outcome), std::to_string(counts));
  }
  [[nodiscard]] Outcome WithBefore(Outcome outcome, const std::string& after) const {
    outcome.changes.push_back({"single_turn", std::to_string(before_), after});
    return WithFindingBefore(std::move(outcome), SameBefore());
  }

  const SaaSettings& settings_;
  const DeviceOutput& output_;
  const MonoNs patience_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs deadline_;
  MonoNs effect_from_ = kNever;
  std::uint32_t before_ = 0;
  int readings_ = 0;       // that may show the effect
  int near_in_a_row_ = 0;  // of these
};

// One reading, shown; with `look` also whether it looks like that of an encoder that was cleared to zero.
class PositionReadout final : public Procedure {
 public:
  PositionReadout(bool look, const SaaSettings& settings, const DeviceOutput& output, MonoNs patience, MonoNs now)
      : look_(look), settings_(settings), output_(output), begun_(now), deadline_(now + patience) {}

  [[nodiscard]] Need Next(MonoNs) const override { return Need::kReading; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnReading(const Reading& reading, MonoNs now) override {
    if (reading.error || reading.at.last < begun_) return OnTime(now);
    const int bits = settings_.format.bits;
    Outcome outcome = Verified(Text("single-turn %u (%.4f deg)", reading.counts, Degrees(reading.counts, bits)));
    outcome.changes.push_back({"single_turn", "", std::to_string(reading.counts)});
    if (look_) {
      outcome.changes.push_back(
          FindingChange(FindingWord(IsNearZero(reading.counts, settings_), AtRest(output_, now))));
    }
    return outcome;
  }
  std::optional<Outcome> OnTime(MonoNs now) override {
    if (now < deadline_) return std::nullopt;
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "no reading came in time");
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
                 "the link was lost before the reading came");
  }

 private:
  const bool look_;
  const SaaSettings& settings_;
  const DeviceOutput& output_;
  const MonoNs begun_;
  const MonoNs deadline_;
};

// For a reading: several periods of a slow stream, or several requests in vain.
constexpr MonoNs kPatience = 2 * kSecond;
constexpr int kPatiencePeriods = 20;

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = {
      // One write is assumed: the manual does not state where the zero is stored.
      MovingDatum(
          {.name = kZeroName,
           .help = "Makes the present shaft angle the encoder's 0: a pulse on CLR, or BC AA CX on a polled bus",
           .verification =
               "two readings in a row show 0 +- 0.2 degrees (or 2 counts), if the shaft was elsewhere before",
           .verified_by_operation = kReadPositionName}),
      {.name = kReadPositionName,
       .help = "Reads the single-turn position once",
       .arguments = {{"after", "an operation, to see whether it took effect: zero", false}},
       .reads_only = true,
       .verification = "the reading itself"},
  };
  return kSpecs;
}

bool Permits(const BusConfig& bus, const DeviceConfig&, std::string_view operation) {
  return operation != kZeroName || static_cast<const SaaBus&>(*bus.family_bus).zero_clearing;
}

Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command, const SaaBus& bus,
                                                 const SaaSettings& settings, const DeviceOutput& output,
                                                 MonoNs now) {
  const MonoNs patience = std::max(kPatience, kPatiencePeriods * bus.refresh);
  if (command.operation == kZeroName) {
    if (bus.zero_clearing) return std::make_unique<ZeroProcedure>(settings, output, patience, now);
    return NotPermitted(
        bus.mode == Mode::kBus
            ? "the bus is configured without zero clearing; if the encoders have it, set zero_clearing: true"
            : "the bus has no CLR line in its configuration; if the encoder has one, name it: lines: {clr: {chip, "
              "line}}");
  }
  if (command.operation != kReadPositionName) return UnknownOperation("saa_serial", command.operation);
  const std::optional<std::string_view> after = FindArgument(command.arguments, "after");
  if (after && after != kZeroName) return BadArgument("after must be zero");
  return std::make_unique<PositionReadout>(after.has_value(), settings, output, patience, now);
}

}  // namespace axlecast::saa_serial
