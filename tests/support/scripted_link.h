#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/device/link.h"
#include "tests/support/fake_clock.h"

namespace axlecast {

// A line in virtual time: reading and sleeping move the FakeClock to the next thing that happens.
class ScriptedLink final : public ByteLink {
 public:
  // Bytes that come `after` the request was written.
  struct Burst {
    MonoNs after = 0;
    std::vector<std::uint8_t> bytes;
  };
  // The other end: what it answers to a request.
  using Peer = std::function<std::vector<Burst>(Bytes request)>;

  explicit ScriptedLink(FakeClock& clock, Peer peer = {}) : clock_(clock), peer_(std::move(peer)) {}

  // The script.
  void SetPeer(Peer peer) { peer_ = std::move(peer); }
  void SetWriteTime(MonoNs time) { write_time_ = time; }
  void ArriveAt(MonoNs at, std::vector<std::uint8_t> bytes) { arrivals_.emplace(at, std::move(bytes)); }
  void LoseAt(MonoNs at) { lost_at_ = at; }
  void WakeAt(MonoNs at) { wakes_.insert(at); }
  void RefuseOpens(int times, std::string problem);
  void SetErrors(LineErrors errors) { errors_ = errors; }

  // What happened.
  [[nodiscard]] const std::vector<std::vector<std::uint8_t>>& written() const { return written_; }
  [[nodiscard]] const std::vector<MonoNs>& write_times() const { return write_times_; }
  [[nodiscard]] const std::vector<MonoNs>& open_times() const { return open_times_; }  // attempts
  [[nodiscard]] std::int64_t waits() const { return waits_; }
  [[nodiscard]] std::int64_t reads_now() const { return reads_now_; }  // of ReadNow

  [[nodiscard]] Result<> Open() override;
  void Close() override { open_ = false; }
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] bool SetBaud(std::int64_t baud) override {
    baud_ = baud;
    return !refuses_baud_;
  }
  void RefuseBaud() { refuses_baud_ = true; }
  [[nodiscard]] std::int64_t baud() const { return baud_; }  // the last one asked for; 0 none
  [[nodiscard]] bool Write(Bytes bytes) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override;
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override;
  [[nodiscard]] Status Wait(MonoNs until) override;
  void Wake() override { woken_ = true; }
  [[nodiscard]] LineErrors Errors() const override { return errors_; }

 private:
  [[nodiscard]] bool Gone() const { return !open_ || clock_.Now() >= lost_at_; }
  [[nodiscard]] MonoNs NextArrival() const { return arrivals_.empty() ? kNever : arrivals_.begin()->first; }

  FakeClock& clock_;
  Peer peer_;
  MonoNs write_time_ = 0;
  std::multimap<MonoNs, std::vector<std::uint8_t>> arrivals_;
  std::multiset<MonoNs> wakes_;
  MonoNs lost_at_ = kNever;
  int refusals_ = 0;
  std::string refusal_;
  LineErrors errors_;
  bool open_ = false;
  bool refuses_baud_ = false;
  std::int64_t baud_ = 0;
  std::atomic<bool> woken_ = false;
  std::vector<std::vector<std::uint8_t>> written_;
  std::vector<MonoNs> write_times_;
  std::vector<MonoNs> open_times_;
  std::int64_t waits_ = 0;
  std::int64_t reads_now_ = 0;
};

}  // namespace axlecast
