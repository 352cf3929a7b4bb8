#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <vector>

#include "core/base/time.h"
#include "core/device/can.h"
#include "core/device/link.h"
#include "core/device/simulator.h"

namespace axlecast {

// The frames that wait in a simulated CAN controller and in its interface's queue. As with a real controller, a frame that no node
// acknowledges is sent again and again, also after the driver has closed its line.
class CanTransmitQueue {
 public:
  static constexpr MonoNs kSendAgain = kMillisecond;
  // A frame is on the bus, and a node has acknowledged it. `own`: it was sent since the line was opened.
  using OnSent = std::function<void(const CanFrame& frame, bool own)>;

  [[nodiscard]] bool empty() const { return frames_.empty(); }
  // The line was opened.
  void Open() { counts_ = {}; }
  // The line was closed: what waits is sent, but is no longer a frame of this driver.
  void Close() {
    for (Waiting& waiting : frames_) waiting.own = false;
  }
  // The adapter was pulled out.
  void Clear() { frames_.clear(); }

  // The first frame of the queue must be sent at once (Send).
  [[nodiscard]] FrameLink::SendResult Add(const CanFrame& frame) {
    if (frames_.size() >= kSize) {
      ++counts_.queue_full;
      return FrameLink::SendResult::kFull;
    }
    ++counts_.pending;
    frames_.push_back({.frame = frame});
    return FrameLink::SendResult::kQueued;
  }

  // Sends in order until a frame is not acknowledged. Answers of the nodes come after the frame that they answer.
  void Send(Simulator& nodes, MonoNs now, const OnSent& on_sent, const Simulator::Transmit& answer) {
    while (!frames_.empty() && Offer(frames_.front(), nodes, now, on_sent, answer)) frames_.pop_front();
  }

  // What the controller reports. `works`: the line is open and the adapter is there.
  [[nodiscard]] CanController Controller(bool works, std::int64_t bitrate) const {
    CanController controller = counts_;
    if (!works) return controller;
    controller.state = frames_.empty() ? CanController::State::kActive : CanController::State::kPassive;
    controller.tec = frames_.empty() ? 0 : 128;
    controller.rec = 0;
    controller.bitrate = bitrate;
    return controller;
  }

 private:
  static constexpr std::size_t kSize = 11;  // the frame in the controller, and ten in the interface's queue
  struct Waiting {
    CanFrame frame;
    bool own = true;
    bool tried = false;  // and nobody has acknowledged it
  };

  [[nodiscard]] bool Offer(Waiting& waiting, Simulator& nodes, MonoNs now, const OnSent& on_sent,
                           const Simulator::Transmit& answer) {
    std::vector<CanPacket> answers;
    const bool acknowledged =
        nodes.OnFrame(waiting.frame, now, [&answers](Bytes bytes) { answers.emplace_back(bytes); });
    if (acknowledged) on_sent(waiting.frame, waiting.own);
    if (acknowledged && waiting.own) --counts_.pending;
    if (!acknowledged && waiting.own && !waiting.tried) ++counts_.unacknowledged;
    waiting.tried = true;
    for (const CanPacket& packet : answers) answer(packet);
    return acknowledged;
  }

  std::deque<Waiting> frames_;
  CanController counts_;
};

}  // namespace axlecast
