#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device/can.h"
#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast {

// One encoder on a simulated CAN bus, of any model: its time, its script, its fault, and the frames that it will send.
// The family's simulator holds the nodes and is the bus between them and the host. Times passed to a node must not run
// backwards.
class SimulatedCanNode : public SimulatedDevice {
 public:
  using Send = std::function<void(const CanFrame& frame)>;  // onto the bus, now

  void SetScript(Script script) { script_ = std::move(script); }
  void Advance(MonoNs now) override { now_ = std::max(now_, now); }

  // Returns whether it is powered and takes part in the bus: it acknowledges what others send.
  [[nodiscard]] virtual bool present() const = 0;
  // Returns the rate at which it takes part, in bit/s; 0: that of the bus as configured.
  [[nodiscard]] virtual std::int64_t bitrate() const { return 0; }
  // Receives a frame of the host or of another node. OnDue sends the reply.
  virtual void OnFrame(const CanFrame& frame, MonoNs now) = 0;
  // Returns when a reply, a cyclic frame or a step of the script is due; kNever if nothing is.
  [[nodiscard]] virtual MonoNs NextDue() const = 0;
  virtual void OnDue(MonoNs now, const Send& send) = 0;
  // Returns the quantities with their values at `now`, then the counters.
  [[nodiscard]] virtual QuantityList State(MonoNs now) const = 0;
  // Returns what is wrong with the node or with its way to the host.
  [[nodiscard]] const SimulatedFault& fault() const { return fault_; }

 protected:
  explicit SimulatedCanNode(std::uint64_t seed) : random_(seed) {}

  // Executes the script up to `now`. The first call starts it, then powers the node up.
  void CatchUp(MonoNs now) {
    if (!std::exchange(started_, true)) {
      now_ = now;
      script_.Start(*this, now);
      if (present()) PowerUp();
    }
    script_.Run(*this, now);
    Advance(now);
  }
  virtual void PowerUp() = 0;

  // Adds a frame to those that will be sent. Frames that are due at the same time keep their order.
  void Queue(MonoNs due, const CanFrame& frame) {
    const auto place = std::upper_bound(pending_.begin(), pending_.end(), due,
                                        [](MonoNs at, const Pending& pending) { return at < pending.due; });
    pending_.insert(place, {due, frame});
  }
  struct Pending {
    MonoNs due = 0;
    CanFrame frame;
  };
  // Removes and returns the next frame that is due at `now`.
  [[nodiscard]] std::optional<Pending> TakeDue(MonoNs now) {
    if (pending_.empty() || pending_.front().due > now) return std::nullopt;
    Pending next = pending_.front();
    pending_.erase(pending_.begin());
    return next;
  }
  // Returns when the script or a frame that will be sent is due.
  [[nodiscard]] MonoNs PendingDue() const {
    if (!started_) return 0;
    return pending_.empty() ? script_.NextDue() : std::min(script_.NextDue(), pending_.front().due);
  }

  // Returns true for the share of frames that an intermittent fault loses.
  [[nodiscard]] bool LosesFrame() {
    return fault_.kind == SimulatedFault::Kind::kIntermittent && random_.Share() < fault_.amount;
  }
  // Returns the frame as a line with the fault delivers it.
  [[nodiscard]] CanFrame Damaged(const CanFrame& frame) {
    std::vector<std::uint8_t> data(Bytes(frame.data).begin(), Bytes(frame.data).end());
    data.resize(Damage(data, fault_, random_));
    return {.id = frame.id, .data = InlineBytes<kMaxCanData>(Bytes(data))};
  }
  static void AddCounters(QuantityList& list,
                          std::initializer_list<std::pair<std::string_view, std::int64_t>> counters) {
    for (const auto& [name, count] : counters) list.emplace_back(name, std::to_string(count));
  }

  MonoNs now_ = 0;
  SeededRandom random_;
  SimulatedFault fault_;
  std::vector<Pending> pending_;
  bool started_ = false;

 private:
  Script script_;
};

}  // namespace axlecast
