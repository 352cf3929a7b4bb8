// "The machine is in a state in which this may be done": permits of a control process. docs/client.md.
//
//   axlecast::PermitIssuer issuer(settings);
//   ... in every cycle, while the axis is at rest and not controlled:
//   issuer.Allow("axis1", {"zero_single_turn"}, 200);
//   ... when that ends: issuer.Withdraw("axis1");     // or do nothing: it expires
//
// C++17. Link axlecast_client.
#pragma once

#include <axlecast/client_settings.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace axlecast {

class TimeBase;

struct PermitOptions {
  // Permits then state their instant on the time base too, so that drivers of other hosts need no UNIX time to check them. It must
  // exist as long as the issuer. Allow and Withdraw read it: no other thread may change it during these calls. Null: not stated.
  const TimeBase* time = nullptr;
};

// Every method may be called from any thread, and none throws. One thread of its own signs and sends. That thread has the scheduling
// of the thread that constructs the issuer.
class PermitIssuer {
 public:
  // Permits count when they are signed with a key of role control. Takes up to 1 s where multicast does not work.
  explicit PermitIssuer(const ClientSettings& settings, const PermitOptions& options = {});
  // Ends at once: permits that were sent expire.
  ~PermitIssuer();
  PermitIssuer(PermitIssuer&& other) noexcept;
  PermitIssuer& operator=(PermitIssuer&& other) noexcept;

  // Fails if no permit can be sent: the error is the cause and the fix.
  [[nodiscard]] Result<> state() const;

  static constexpr std::int32_t kMaxValidMs = 500;
  static constexpr std::size_t kMaxOperations = 24;

  // Allows exactly these operations of the device, until `valid_ms` (1..500) after this call; it replaces what was allowed before.
  // Call it in every cycle in which that is true. For a control loop: it signs nothing, sends nothing and does not wait for the
  // issuer's thread; it costs about 1 us, and a few us if the device or the operations are not those of the last call.
  //
  // The thread sends a change at once, and else the newest call every quarter of valid_ms. The instant of a permit is that of the
  // call. No call is sent twice: when the calls end, the permit ends valid_ms after the last one (rounded up to 1 ms) plus the time
  // of the message on the network. False, and nothing is allowed, if state() fails, or valid_ms, the number of operations or a name
  // is out of range.
  bool Allow(const std::string& device, const std::vector<std::string>& operations, std::int32_t valid_ms);
  // Allows nothing any more. Signs and sends in the calling thread, about 0.1 ms. A driver that receives it refuses every permit of
  // an earlier call of Allow, also one that arrives later. Where the message is lost, the last permit ends by itself. If nothing
  // was allowed since the last call, it does nothing. False if the message was not sent.
  bool Withdraw(const std::string& device);

  struct Totals {
    std::int64_t sent = 0;     // permits and withdrawals
    std::int64_t failed = 0;   // the system refused to send them
    std::int64_t expired = 0;  // they ended before the thread could send them
  };
  // What became of the calls since the start.
  [[nodiscard]] Totals totals() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace axlecast
