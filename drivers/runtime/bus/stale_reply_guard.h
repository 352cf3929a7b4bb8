#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/device/device.h"
#include "core/device/step.h"

namespace axlecast {

// Prevents a late reply from being taken as the reply to a newer request, from which it may not be distinguishable. It
// holds every request of the bus that did not end with its own reply, until the late bound has passed since the request
// was sent. While a request is held, no request may be sent whose reply could look like the missing reply.
//
// Replies may come in any order. Only the request's own reply, whole or damaged, ends the wait early. A device is assumed to
// answer each request at most once.
//
// One guard serves the whole bus, because replies of several devices can look alike. It is kept while the line is closed.
// The requests of an earlier process are unknown. Until the first late bound has passed, or every device has answered a
// fresh request, only requests whose shape is `fresh` or `interchangeable` may be sent. This case alone assumes that
// replies come in the order of their requests.
//
// Allocates nothing after AddDevice. Time is an argument.
class StaleReplyGuard final : public PendingReplies {
 public:
  // `bound`: the longest time from a request to its reply. 0: no request is held.
  explicit StaleReplyGuard(MonoNs bound) : bound_(bound) {}

  void AddDevice() { devices_.emplace_back(); }
  // Reports that the line is open. Called again each time the line is opened.
  void Start(MonoNs now);

  [[nodiscard]] MonoNs FreeAt(const Exchange& exchange, MonoNs now) const override {
    return count_ == 0 && now >= unknown_until_ ? now : Look(exchange, now);
  }

  // Reports that the exchange of a device ended as kReply, kTimeout or kLinkDown.
  void Ended(const Exchange& exchange, std::size_t device, const Event& event);
  // Reports bytes that came without a request.
  void CameUnexpected(Bytes bytes, MonoNs now);

  // Returns how many late replies of a device were recognised.
  [[nodiscard]] std::int64_t late(std::size_t device) const { return devices_[device].late; }
  // Returns how many requests may still be answered.
  [[nodiscard]] std::size_t held() const { return count_; }

  static constexpr std::size_t kCapacity = 64;

 private:
  struct Held {
    Frame request;
    ReplyLength reply_length = nullptr;
    ReplyShape shape;
    std::size_t device = 0;
    MonoNs until = 0;
  };
  struct PerDevice {
    bool unknown = true;  // requests of an earlier process may still be answered
    std::int64_t late = 0;
  };

  [[nodiscard]] MonoNs Look(const Exchange& exchange, MonoNs now) const;
  [[nodiscard]] static bool Conflicts(const Held& held, const ReplyShape& shape);
  void OnOwnReply(const Exchange& exchange, std::size_t device, MonoNs sent);
  // Finds late replies to held requests in the unexpected bytes, and releases these requests.
  void RecogniseAll();
  [[nodiscard]] bool RecogniseOne();
  [[nodiscard]] std::size_t FindReplyAt(Bytes bytes) const;
  void Hold(const Exchange& exchange, std::size_t device, MonoNs sent);
  void Expire(MonoNs now);
  void Erase(std::size_t index);

  const MonoNs bound_;
  std::vector<PerDevice> devices_;
  bool started_ = false;
  MonoNs unknown_until_ = 0;
  std::array<Held, kCapacity> held_{};  // oldest first
  std::size_t count_ = 0;
  MonoNs full_until_ = 0;  // another request did not fit into held_
  Frame unexpected_;       // the newest bytes that came without a request
};

}  // namespace axlecast
