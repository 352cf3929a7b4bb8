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

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace axlecast {

// Every method may be called from any thread, and none throws.
class PermitIssuer {
 public:
  // Permits count when they are signed with a key of role control. Takes up to 1 s where multicast does not work.
  explicit PermitIssuer(const ClientSettings& settings);
  ~PermitIssuer();
  PermitIssuer(PermitIssuer&& other) noexcept;
  PermitIssuer& operator=(PermitIssuer&& other) noexcept;

  // Fails if no permit can be sent: the error is the cause and the fix.
  [[nodiscard]] Result<> state() const;

  static constexpr std::int32_t kMaxValidMs = 500;
  static constexpr std::size_t kMaxOperations = 24;

  // Allows exactly these operations of the device, for `valid_ms` (1..500) from its arrival; it replaces what was
  // allowed before. Sends one message and returns: repeat it well within valid_ms, since one may be lost. False, and
  // nothing is sent, if state() fails, or valid_ms, the number of operations or a name is out of range.
  bool Allow(const std::string& device, const std::vector<std::string>& operations, std::int32_t valid_ms);
  // Allows nothing any more. Where the message is lost, the last permit ends by itself.
  bool Withdraw(const std::string& device);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace axlecast
