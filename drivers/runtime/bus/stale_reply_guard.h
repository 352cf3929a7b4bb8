#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/device/device.h"
#include "core/device/step.h"

namespace axlecast {

// Keeps a reply that comes late from being taken for the reply to a younger request, which nothing in its bytes may
// tell from its own. It holds every request of the bus that did not end with its own reply, until the late bound has
// passed since it was sent. While one is held, no request may be sent whose reply could look like its reply.
//
// Replies may come in any order: nothing but its own reply, whole or damaged, ends the wait for a request, and it is
// assumed that a device answers each request at most once.
//
// One guard serves the whole bus, because replies of several devices can look alike. It survives the closing of the
// line. The requests of an earlier process are unknown: for the first late bound only requests may be sent whose shape
// is `fresh` or `interchangeable`, until every device has answered a fresh one: here alone it is assumed that replies come in
// the order of their requests.
//
// Allocates nothing after AddDevice. Time is an argument.
class StaleReplyGuard final : public PendingReplies {
 public:
  // A reply comes at most `bound` after its request was sent. 0: nothing is held.
  explicit StaleReplyGuard(MonoNs bound) : bound_(bound) {}

  void AddDevice() { devices_.emplace_back(); }
  // The line is open. Called again when it was opened again.
  void Start(MonoNs now);

  [[nodiscard]] MonoNs FreeAt(const Exchange& exchange, MonoNs now) const override {
    return count_ == 0 && now >= unknown_until_ ? now : Look(exchange, now);
  }

  // The exchange of a device ended as kReply, kTimeout or kLinkDown.
  void Ended(const Exchange& exchange, std::size_t device, const Event& event);
  // Bytes came that nobody was waiting for.
  void CameUnexpected(Bytes bytes, MonoNs now);

  // Late replies of a device that were recognised.
  [[nodiscard]] std::int64_t late(std::size_t device) const { return devices_[device].late; }
  // Requests that may still be answered.
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
  // Looks for late replies to held requests in the unexpected bytes; those requests are held no more.
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
  MonoNs full_until_ = 0;  // one more did not fit
  Frame unexpected_;       // the newest bytes that nobody was waiting for
};

}  // namespace axlecast
