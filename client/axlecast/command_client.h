// Commands from a control process: send, follow, cancel, await the outcome, ask again later. docs/client.md.
//
//   const auto settings = axlecast::SettingsOfMachine("machine.yaml", "plc");  // or fill ClientSettings
//   if (!settings) ... settings.error().text
//   axlecast::CommandClient client(*settings);
//   axlecast::CommandRequest request;
//   request.device = "axis1";
//   request.operation = "zero_single_turn";
//   const auto id = client.Send(request);
//   const auto result = client.Await(id, 10'000);
//   if (result.outcome() == axlecast::CommandOutcome::kDone) ...
//
// C++17. Link axlecast_client.
#pragma once

#include <axlecast/client_settings.h>
#include <axlecast/command.h>

#include <cstdint>
#include <functional>
#include <memory>

namespace axlecast {

// Every method may be called from any thread, and none throws. One thread of its own sends, repeats and listens.
class CommandClient {
 public:
  using StatusCallback = std::function<void(const CommandResult& result)>;

  // Takes up to 1 s where multicast does not work; see state().
  explicit CommandClient(const ClientSettings& settings);
  // Ends at once; the bridge continues commands under way. Not from the callback, nor while another thread is within a
  // method.
  ~CommandClient();
  CommandClient(CommandClient&& other) noexcept;
  CommandClient& operator=(CommandClient&& other) noexcept;

  // Fails if no command can be sent: the error is the cause and the fix. Then every command is kNotAccepted.
  [[nodiscard]] Result<> state() const;

  // Returns at once; many may be under way. The id can be kept, to ask for the outcome later.
  CommandId Send(const CommandRequest& request);

  // `callback` receives what becomes known of every command of this client:
  // - each new state and progress, with `under_way` true;
  // - its end, whatever it is (kNotAccepted and kUnknown too), with `under_way` false: exactly once, and last.
  // It is called in the client's own thread: it must return soon, must not throw, and must not Await or Query. It may Send and
  // Cancel. Set it before the first Send. An empty one ends the calls; a call that is under way then is still finished. There are
  // no calls for commands that are under way when the client is destroyed, and none if state() fails with "no thread".
  void OnStatus(StatusCallback callback);

  // Waits for the outcome, and after an INDETERMINATE for its finding. When neither comes in time the outcome is
  // kUnknown: the command may still act until its validity ends, and a later Await or Query returns the outcome. The newest 4,096 that
  // have ended are kept.
  [[nodiscard]] CommandResult Await(const CommandId& id, std::int64_t timeout_ms);

  // From now on asks for it to be given up. It still ends in its one outcome.
  void Cancel(const CommandId& id);

  // Returns the state of the command `id` of any client. Waits only for the bridge's answer. Needs no key.
  [[nodiscard]] CommandResult Query(const CommandId& id, std::int64_t timeout_ms);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace axlecast
