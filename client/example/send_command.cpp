// Zeroes an encoder and homes its axis in software, as a control process would, and handles every outcome:
//
//   send_command machine.yaml axis1 0.0 [COMMAND_KEY [PERMIT_KEY]]
//
// The keys are names under `bridge: keys:` of the machine's file: COMMAND_KEY signs the commands (a zero needs role maintainer),
// PERMIT_KEY has role control. Where the file allows unsigned commands none is needed.
// Exit codes as those of `axlecast do`: docs/commands.md.
#include <axlecast/command_client.h>
#include <axlecast/machine_settings.h>
#include <axlecast/permit_issuer.h>

#include <cstdio>
#include <string>

namespace {

using axlecast::ClientSettings;
using axlecast::CommandClient;
using axlecast::CommandId;
using axlecast::CommandOutcome;
using axlecast::CommandRequest;
using axlecast::CommandResult;
using axlecast::PermitIssuer;

constexpr int kDone = 0, kUsage = 2, kRejected = 3, kFailed = 4, kIndeterminate = 5, kNoAnswer = 6, kUnverified = 7;

struct Axis {
  CommandClient& client;
  PermitIssuer& issuer;
  std::string device;
};

// Waits in short steps, in each of which the permit is renewed: a real control process does this in its cycle.
// Allow only what the machine's state allows: the drive is off, nothing moves the axis.
CommandResult AwaitWithPermit(const Axis& axis, const CommandId& id, const std::string& operation) {
  CommandResult result;
  for (int cycle = 0; cycle < 300; ++cycle) {
    axis.issuer.Allow(axis.device, {operation}, 400);
    result = axis.client.Await(id, 100);
    if (!result.under_way) break;
  }
  axis.issuer.Withdraw(axis.device);
  return result;
}

// Nothing came in time. That is no failure: the command may have been done, or may still be. Ask; do not repeat it.
CommandResult AskLater(const Axis& axis, const CommandId& id) {
  std::printf("no outcome yet; asking for %s\n", axlecast::IdText(id).c_str());
  CommandResult result;
  for (int attempt = 0; attempt < 10; ++attempt) {
    result = axis.client.Query(id, 2'000);
    if (result.outcome() != CommandOutcome::kUnknown) break;
  }
  return result;
}

int Handle(const CommandResult& result) {
  const std::string text = result.problem.empty() ? result.status.text : result.problem;
  std::printf("%s: ", result.status.operation.c_str());
  switch (result.outcome()) {
    case CommandOutcome::kDone:
      std::printf("done and verified\n");
      return kDone;
    case CommandOutcome::kDoneUnverified:
      std::printf("done, but nothing can be read back: look at the device. %s\n", text.c_str());
      return kUnverified;
    case CommandOutcome::kPrepared:
      std::printf("would be done, with token %s\n", axlecast::IdText(result.token()).c_str());
      return kDone;
    case CommandOutcome::kRejected:
    case CommandOutcome::kExpired:
    case CommandOutcome::kCancelled:
      std::printf("nothing was done (%s): %s; %s\n", std::string(result.reason()).c_str(), text.c_str(),
                  result.temporary() ? "it can be sent again later" : "it will be refused again as it is");
      return kRejected;
    case CommandOutcome::kFailed:
      std::printf("failed, perhaps in part: %s; look at the device\n", text.c_str());
      return kFailed;
    case CommandOutcome::kIndeterminate:
      std::printf("it is not known whether it was done (finding %d): %s; look at the device\n",
                  result.status.finding, text.c_str());
      return kIndeterminate;
    case CommandOutcome::kNotAccepted:
      std::printf("nothing was done: %s\n", text.c_str());
      return kNoAnswer;
    case CommandOutcome::kUnknown:
      std::printf("not known: %s\n", text.c_str());
      return kNoAnswer;
  }
  return kNoAnswer;
}

int Do(const Axis& axis, const std::string& operation, const std::string& key, const std::string& value) {
  CommandRequest request;
  request.device = axis.device;
  request.operation = operation;
  if (!key.empty()) request.arguments = {{key, value}};
  request.valid_ms = 3'000;
  request.reason = "send_command example";
  const CommandId id = axis.client.Send(request);
  CommandResult result = AwaitWithPermit(axis, id, operation);
  if (result.outcome() == CommandOutcome::kUnknown) result = AskLater(axis, id);
  return Handle(result);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: send_command CONFIG DEVICE VALUE [COMMAND_KEY [PERMIT_KEY]]\n");
    return kUsage;
  }
  const auto commands = axlecast::SettingsOfMachine(argv[1], argc > 4 ? argv[4] : "");
  const auto permits = axlecast::SettingsOfMachine(argv[1], argc > 5 ? argv[5] : "");
  if (!commands || !permits) {
    std::fprintf(stderr, "%s\n", (commands ? permits : commands).error().text.c_str());
    return 1;
  }
  CommandClient client(*commands);
  PermitIssuer issuer(*permits);
  if (!client.state() || !issuer.state()) {
    std::fprintf(stderr, "%s\n", (client.state() ? issuer.state() : client.state()).error().text.c_str());
    return 1;
  }
  client.OnStatus([](const CommandResult& result) {
    if (!result.under_way) return;  // the end: Handle prints it
    const axlecast::command_status_t& status = result.status;
    std::printf("  %s: state %d, %.0f %%\n", status.operation.c_str(), status.state, 100.0F * status.progress);
  });
  const Axis axis{client, issuer, argv[2]};
  // In this order: a zero in the encoder makes every datum from before worthless.
  const int zeroed = Do(axis, "zero_single_turn", "", "");
  if (zeroed != kDone && zeroed != kUnverified) return zeroed;
  return Do(axis, "set_datum", "value", argv[3]);
}
