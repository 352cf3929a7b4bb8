#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/config/load.h"
#include "tests/conformance/example_link.h"
#include "tests/support/recording_output.h"

namespace axlecast {

// How often a reply is late.
enum class LateMix : std::uint8_t {
  kAlways,  // each by a random time
  kHalf,    // for half of the time each by a random time, else none
  kRare,    // for a fiftieth of the time
  kMixedUp,  // for half of the time, each by a time of its own: later ones overtake. Frames of one stream keep their order
};
inline constexpr std::array<LateMix, 4> kLateMixes = {LateMix::kAlways, LateMix::kHalf, LateMix::kRare,
                                                      LateMix::kMixedUp};
[[nodiscard]] const char* MixName(LateMix mix);

// The devices of a bus on their simulators, in virtual time, with replies that come up to ten timeouts late, or frames of
// a stream up to two fifths of late_us, and with quantities that change all the time. Every reading is compared with the truth: a shaft that turns at a
// constant speed, a motor whose voltage grows step by step.
class LateRun final : private BusObserver {
 public:
  // `machine`, `bus` and `secrets` outlive it.
  LateRun(const MachineConfig& machine, const BusConfig& bus, SecretSource& secrets, LateMix mix);

  // Runs until so many more exchanges are over, or `most` has passed. A frame that is sent unasked counts as an exchange.
  void Exchange(std::int64_t count, MonoNs maximum = 1'000'000 * kSecond);

  [[nodiscard]] std::int64_t exchanges() const { return streams_ ? readings_ : bus_->counters().exchanges; }
  [[nodiscard]] std::int64_t readings() const { return readings_; }
  // Readings whose interval does not hold the instant of their value.
  [[nodiscard]] std::int64_t missed() const { return missed_; }
  // The widest distance of an interval from that instant, as far as it is known.
  [[nodiscard]] MonoNs worst() const { return worst_; }

 private:
  class Judge final : public RecordingOutput {
   public:
    Judge(LateRun& run, std::size_t index) : run_(run), index_(index) {}
    void OnSample(const Sample& sample) override { run_.OnSample(index_, sample); }
    void OnMotor(const MotorReading& reading) override { run_.OnMotor(reading); }
    void OnError(ErrorKind, Interval) override {}
    void OnAlarm(const AlarmSpec&, AlarmState, MonoNs) override {}
    void OnStarting(std::string_view) override {}

   private:
    LateRun& run_;
    const std::size_t index_;
  };
  struct Truth {
    MonoNs at = 0;
    double counts = 0;  // then
    double per_ns = 0;
    double turn = 0;  // counts
  };

  void OnLink(bool, std::string_view, MonoNs) override {}
  void OnSample(std::size_t index, const Sample& sample);
  void OnMotor(const MotorReading& reading);
  void SetAll(const char* key, const std::string& value);
  void Calibrate();
  [[nodiscard]] double CountsOf(std::size_t index, MonoNs at) const;
  void Step();
  void Run(MonoNs duration);
  [[nodiscard]] bool LateNow() const;
  void Count(MonoNs distance);

  const BusConfig& config_;
  const LateMix mix_;
  FakeClock clock_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<ExampleLink> link_;
  std::vector<std::unique_ptr<Judge>> outputs_;
  std::vector<std::unique_ptr<Device>> devices_;
  std::unique_ptr<Bus> bus_;
  std::vector<Truth> truth_;
  std::vector<MonoNs> steps_;  // when the voltage was changed
  MonoNs next_step_ = 0;
  std::uint64_t phase_ = 0;
  bool late_ = false;
  bool streams_ = false;  // the devices send by themselves
  bool judging_ = false;
  std::int64_t readings_ = 0;
  std::int64_t missed_ = 0;
  MonoNs worst_ = 0;
};

}  // namespace axlecast
