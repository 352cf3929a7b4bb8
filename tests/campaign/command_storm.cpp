// Real processes: commands through the client library to simulated encoders, one after the other on each, with the
// encoder's own counters read before and after. Each acts at most once, has one outcome, and that agrees with what the
// encoder did and with the journal. The relays that lose messages, and all other processes, are started by
// tests/e2e/test_storm.py.
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "bridge/store/history.h"
#include "client/axlecast/command_client.h"
#include "client/axlecast/machine_settings.h"
#include "core/command/commands.h"
#include "core/config/load.h"
#include "core/messages/enum_names.h"
#include "platform/os/system_clock.h"
#include "tests/campaign/status_listener.h"
#include "tests/campaign/storm_tally.h"
#include "tools/axlecast/run/simulation_server.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kAwaitMs = 20'000;
constexpr int kAsks = 15;  // of kAwaitMs, until a command counts as never answered

// What the device counts itself.
struct Counters {
  std::int64_t zeroings = 0;
  std::int64_t turn_resets = 0;
  std::int64_t error_clears = 0;
  std::int64_t eeprom_writes = 0;

  [[nodiscard]] std::int64_t sum() const { return zeroings + turn_resets + error_clears + eeprom_writes; }
  bool operator==(const Counters&) const = default;
};

// Those of an operation, and the share in percent of the storm that it is.
struct Kind {
  const char* operation;
  int percent;
  std::int64_t Counters::*counter;  // null: it only reads
};

constexpr Kind kKinds[] = {{"eeprom_write", 50, &Counters::eeprom_writes},
                           {"eeprom_read", 20, nullptr},
                           {"clear_errors", 15, &Counters::error_clears},
                           {"zero_single_turn", 10, &Counters::zeroings},
                           {"reset_turns_and_errors", 5, &Counters::turn_resets}};

struct Order {
  std::int64_t count = 0;
  std::string client_file;
  std::string bridge_file;
  std::uint32_t seed = 1;
  int cancels = 5;      // percent
  int short_lived = 5;  // percent
  std::string journal;
};

struct Ended {
  CommandResult result;
  bool reads = false;
};

class Storm {
 public:
  Storm(const Order& order, const MachineConfig& machine, const ClientSettings& settings)
      : order_(order), machine_(machine), client_(settings) {}

  [[nodiscard]] std::string problem() const { return ErrorText(client_.state()); }

  void Run() {
    std::vector<std::thread> threads;
    std::int64_t left = order_.count;
    const auto axes = static_cast<std::int64_t>(machine_.buses.size());
    for (std::int64_t axis = 0; axis < axes; ++axis) {
      const std::int64_t share = left / (axes - axis);
      left -= share;
      const BusConfig& bus = machine_.buses[static_cast<std::size_t>(axis)];
      threads.emplace_back([this, &bus, share, axis] { RunAxis(bus, share, static_cast<std::uint32_t>(axis)); });
    }
    for (std::thread& thread : threads) thread.join();
  }

  // Compares with the outcomes that the bridge sent to anybody and with its journal.
  void Compare(const std::map<CommandId, StatusListener::Told>& told) {
    for (const auto& [id, heard] : told) {
      if (heard.states.size() > 1 || heard.findings.size() > 1) {
        tally_.Breach(IdText(id) + ": the bridge reported more than one outcome");
      }
    }
    HistoryReader history(order_.journal);
    std::map<CommandId, S> journalled;
    for (const CommandRow& row : history.Commands({})) journalled[IdOf(row.record.status.id)] = row.record.status;
    if (!history.state()) tally_.Breach(history.state().error().text);
    for (const auto& [id, ended] : ended_) CompareOne(id, ended, journalled);
    std::printf("  %10zu  commands in the journal\n", journalled.size());
    for (const auto& [id, status] : journalled) {
      if (status.is_final == 0) tally_.Breach(IdText(id) + ": no outcome in the journal");
      if (!ended_.contains(id)) tally_.Breach(IdText(id) + ": in the journal, and nobody gave it");
    }
  }

  [[nodiscard]] const StormTally& tally() const { return tally_; }

 private:
  void CompareOne(const CommandId& id, const Ended& ended, const std::map<CommandId, S>& journalled) {
    const auto found = journalled.find(id);
    const CommandResult& result = ended.result;
    if (ended.reads) {
      if (found != journalled.end()) tally_.Breach(IdText(id) + ": a read in the journal");
      return;
    }
    if (found == journalled.end()) {
      // What was refused at once is not noted; neither is what never came.
      const bool nothing =
          result.outcome() == CommandOutcome::kNotAccepted || result.outcome() == CommandOutcome::kRejected ||
          result.outcome() == CommandOutcome::kExpired || result.outcome() == CommandOutcome::kCancelled;
      if (!nothing) tally_.Breach(IdText(id) + ": done, and not in the journal");
      return;
    }
    if (result.outcome() == CommandOutcome::kNotAccepted) {
      tally_.Breach(IdText(id) + ": in the journal, and its client was informed that no bridge accepted it");
    } else if (found->second.state != result.status.state || found->second.finding != result.status.finding) {
      tally_.Breach(IdText(id) + ": the journal has " + Words(found->second) + ", its client received " +
                    Words(result.status));
    }
  }

  static std::string Words(const S& status) {
    std::string words(StateName(status.state));
    if (status.finding != S::FINDING_NONE) words += ", " + std::string(FindingName(status.finding));
    if (status.reason_code != S::REASON_NONE) words += ", " + std::string(ReasonName(status.reason_code));
    return words;
  }

  std::optional<Counters> Count(const BusConfig& bus) {
    const std::string place = RunDirectory(machine_.machine) + '/' + bus.name + ".ctl";
    const auto answer = nlohmann::json::parse(AskControlSocket(place, R"({"show":true})"), nullptr, false);
    const std::string& device = bus.devices.front().name;
    if (!answer.is_object() || !answer.contains("devices")) return std::nullopt;
    const auto& shown = answer["devices"][device];
    return Counters{.zeroings = shown.value("zeroings", std::int64_t{-1}),
                    .turn_resets = shown.value("turn_resets", std::int64_t{-1}),
                    .error_clears = shown.value("error_clears", std::int64_t{-1}),
                    .eeprom_writes = shown.value("eeprom_writes", std::int64_t{-1})};
  }

  void RunAxis(const BusConfig& bus, std::int64_t count, std::uint32_t axis) {
    std::mt19937 random(order_.seed * 1'000 + axis);
    std::optional<Counters> before = Count(bus);
    for (std::int64_t number = 0; number < count; ++number) {
      if (!before) return tally_.Breach(bus.name + ": its simulator does not answer");
      const Kind& kind = Draw(random);
      const CommandResult result = One(bus, kind, number, random);
      const std::optional<Counters> after = Count(bus);
      if (after) Judge(kind, result, *before, *after);
      before = after;
    }
    // Nothing may come later.
    const std::optional<Counters> last = Count(bus);
    if (last != before) tally_.Breach(bus.name + ": something acted after its outcome");
  }

  static const Kind& Draw(std::mt19937& random) {
    auto dice = static_cast<int>(random() % 100);
    for (const Kind& kind : kKinds) {
      dice -= kind.percent;
      if (dice < 0) return kind;
    }
    return kKinds[0];
  }

  CommandResult One(const BusConfig& bus, const Kind& kind, std::int64_t number, std::mt19937& random) {
    const std::string operation = kind.operation;
    CommandRequest request;
    request.device = bus.devices.front().name;
    request.operation = operation;
    request.valid_ms = 60'000;
    if (operation == "eeprom_write") {
      char byte[3];
      // Another byte than the cell holds, so that each is a write: one that holds its value is not written.
      std::snprintf(byte, sizeof byte, "%02X", static_cast<unsigned>((number + 1) % 256));
      request.arguments = {{"address", "10"}, {"data", byte}};
    }
    if (operation == "eeprom_read") request.arguments = {{"address", "10"}};
    if (Happens(order_.short_lived, random)) request.valid_ms = static_cast<std::int32_t>(1 + random() % 400);
    const bool cancel = Happens(order_.cancels, random);
    const auto cancel_after_ms = static_cast<std::int64_t>(random() % 500);
    const CommandId id = client_.Send(request);
    CommandResult result;
    if (cancel) {
      result = client_.Await(id, cancel_after_ms);
      if (result.under_way) client_.Cancel(id);
    }
    for (int ask = 0; ask < kAsks && result.outcome() == CommandOutcome::kUnknown; ++ask) {
      result = client_.Await(id, kAwaitMs);
      if (result.outcome() == CommandOutcome::kUnknown && !result.under_way) result = client_.Query(id, kAwaitMs);
    }
    const std::lock_guard lock(mutex_);
    ended_[id] = {result, kind.counter == nullptr};
    return result;
  }

  static bool Happens(int percent, std::mt19937& random) { return static_cast<int>(random() % 100) < percent; }

  void Judge(const Kind& kind, const CommandResult& result, const Counters& before, const Counters& after) {
    const std::int64_t all = after.sum() - before.sum();
    const std::int64_t own = kind.counter == nullptr ? 0 : after.*kind.counter - before.*kind.counter;
    const std::string words = Outcome(result);
    tally_.Outcome(kind.operation, words, own);
    const std::string whole = IdText(result.id) + " " + kind.operation + ", " + words + ": " + std::to_string(own) +
                              " effects of its own, " + std::to_string(all) + " in all (" + result.status.text +
                              ")";
    if (own < 0 || own > 1 || all != own) return tally_.Breach(whole);
    if (!Agrees(kind, result, own)) tally_.Breach(whole);
  }

  static std::string Outcome(const CommandResult& result) {
    if (result.outcome() == CommandOutcome::kNotAccepted) return "not accepted";
    if (result.outcome() == CommandOutcome::kUnknown) return "UNKNOWN: " + result.problem;
    return Words(result.status);
  }

  static bool Agrees(const Kind& kind, const CommandResult& result, std::int64_t effects) {
    const bool reads = kind.counter == nullptr;
    switch (result.outcome()) {
      case CommandOutcome::kDone:
      case CommandOutcome::kDoneUnverified:
        return reads || effects == 1;
      case CommandOutcome::kIndeterminate:
        if (result.status.finding == S::FINDING_EFFECT_SEEN) return reads || effects == 1;
        if (result.status.finding == S::FINDING_NO_EFFECT_SEEN) return effects == 0;
        return true;
      case CommandOutcome::kFailed:
        return true;  // in part: the counters show at most once
      case CommandOutcome::kUnknown:
      case CommandOutcome::kPrepared:
        return false;
      default:
        return effects == 0;
    }
  }

  const Order& order_;
  const MachineConfig& machine_;
  CommandClient client_;
  StormTally tally_;
  std::mutex mutex_;
  std::map<CommandId, Ended> ended_;
};

int RunStorm(const Order& order, const MachineConfig& machine, const ClientSettings& settings,
             const MachineConfig& bridge) {
  const StatusListener ear(bridge.lcm.command_url, bridge.lcm.prefix);
  Storm storm(order, machine, settings);
  const std::string problem = storm.problem().empty() ? ear.problem() : storm.problem();
  if (!problem.empty()) {
    std::fprintf(stderr, "%s\n", problem.c_str());
    return 1;
  }
  const SystemClock clock;
  const MonoNs begin = clock.Now();
  storm.Run();
  const double seconds = static_cast<double>(clock.Now() - begin) / kSecond;
  std::printf("%" PRId64 " commands to %zu encoders in %.0f s, %.1f a second\n", storm.tally().ended(),
              machine.buses.size(), seconds, static_cast<double>(storm.tally().ended()) / seconds);
  storm.Compare(ear.told());
  storm.tally().Print();
  std::printf("%" PRId64 " breaches\n", storm.tally().breaches());
  return storm.tally().breaches() == 0 && storm.tally().ended() == order.count ? 0 : 1;
}

int Main(int argc, char** argv) {
  Order order;
  CLI::App app{"Commands to simulated encoders, each judged by the encoder's own counters and by the journal."};
  app.footer("Exit codes: 0 no breach, 1 a breach, 2 usage. One device on each bus.");
  app.add_option("COUNT", order.count, "Commands in all")->required()->check(CLI::PositiveNumber);
  app.add_option("--config", order.client_file, "The machine's file as the client sees it")->required();
  app.add_option("--bridge-config", order.bridge_file, "As the bridge sees it")->required();
  app.add_option("--journal", order.journal, "The bridge's journal")->required();
  app.add_option("--seed", order.seed)->capture_default_str();
  app.add_option("--cancels", order.cancels, "Percent")->check(CLI::Range(0, 100))->capture_default_str();
  app.add_option("--short-lived", order.short_lived, "Percent")->check(CLI::Range(0, 100))->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  ConfigErrors errors(order.client_file);
  const auto machine = LoadConfig(order.client_file, errors);
  ConfigErrors bridge_errors(order.bridge_file);
  const auto bridge = LoadConfig(order.bridge_file, bridge_errors);
  const auto settings = SettingsOfMachine(order.client_file, "");
  if (!machine || !bridge || !settings) {
    std::fprintf(stderr, "%s%s%s\n", errors.Text().c_str(), bridge_errors.Text().c_str(),
                 ErrorText(settings).c_str());
    return 1;
  }
  return RunStorm(order, *machine, *settings, *bridge);
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) { return axlecast::Main(argc, argv); }
