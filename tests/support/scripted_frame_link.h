#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/device/link.h"
#include "tests/support/fake_clock.h"

namespace axlecast {

// A CAN bus in virtual time: sleeping moves the FakeClock to the next thing that happens. As on a real one, a frame is
// confirmed once some node acknowledges it, and waits for that as long as it takes, also beyond Close.
class ScriptedFrameLink final : public FrameLink {
 public:
  // A frame that comes `after` another was on the bus.
  struct Answer {
    MonoNs after = 0;
    CanFrame frame;
  };
  // The other nodes: what they answer to a frame that they have acknowledged.
  using Peer = std::function<std::vector<Answer>(const CanFrame& frame)>;

  explicit ScriptedFrameLink(FakeClock& clock, Peer peer = {}) : clock_(clock), peer_(std::move(peer)) {}

  // The script.
  void SetPeer(Peer peer) { peer_ = std::move(peer); }
  void ArriveAt(MonoNs at, const CanFrame& frame) { Arrive(at, frame, false); }
  void SetSendTime(MonoNs time) { send_time_ = time; }  // from Send to the acknowledge; 0 by default
  void Deafen() { deaf_ = true; }                       // nobody acknowledges what is sent from now on
  void Hear();  // what is still to be sent goes out now, and all that follows
  void SetQueue(std::size_t frames) {
    queue_ = frames;
  }  // so many unacknowledged ones fit; 10 by default, as Linux
  void LoseAt(MonoNs at) { lost_at_ = at; }
  void WakeAt(MonoNs at) { wakes_.insert(at); }
  void RefuseOpens(int times, std::string problem);
  void SetErrors(LineErrors errors) { errors_ = errors; }
  void SetController(CanController controller) { controller_ = controller; }

  // What happened.
  [[nodiscard]] const std::vector<CanFrame>& sent() const { return sent_; }  // queued ones only
  [[nodiscard]] const std::vector<MonoNs>& send_times() const { return send_times_; }
  [[nodiscard]] const std::vector<MonoNs>& open_times() const { return open_times_; }  // attempts
  [[nodiscard]] std::int64_t waits() const { return waits_; }
  [[nodiscard]] std::size_t pending() const { return pending_.size(); }  // sent, and acknowledged by nobody

  [[nodiscard]] Result<> Open() override;
  void Close() override { open_ = false; }
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override;
  [[nodiscard]] Status Receive(Received& received) override;
  // With the frames that Send refused, and drops as the script sets them.
  [[nodiscard]] CanController Controller() override;
  [[nodiscard]] Status Wait(MonoNs until) override;
  void Wake() override { woken_ = true; }
  [[nodiscard]] LineErrors Errors() const override { return errors_; }

 private:
  struct Arrival {
    CanFrame frame;
    bool own = false;
  };

  [[nodiscard]] bool Gone() const { return !open_ || clock_.Now() >= lost_at_; }
  [[nodiscard]] MonoNs NextArrival() const { return arrivals_.empty() ? kNever : arrivals_.begin()->first; }
  void Arrive(MonoNs at, const CanFrame& frame, bool own);
  void Deliver(const CanFrame& frame, MonoNs at);

  FakeClock& clock_;
  Peer peer_;
  std::multimap<MonoNs, Arrival> arrivals_;
  std::vector<CanFrame> pending_;
  std::multiset<MonoNs> wakes_;
  MonoNs send_time_ = 0;
  MonoNs lost_at_ = kNever;
  std::size_t queue_ = 10;
  std::int64_t refused_sends_ = 0;
  int refusals_ = 0;
  std::string refusal_;
  LineErrors errors_;
  CanController controller_;
  bool open_ = false;
  bool deaf_ = false;
  std::atomic<bool> woken_ = false;
  std::vector<CanFrame> sent_;
  std::vector<MonoNs> send_times_;
  std::vector<MonoNs> open_times_;
  std::int64_t waits_ = 0;
};

}  // namespace axlecast
