#include "tests/command_simulation/world.h"

#include <algorithm>
#include <axlecast/command_t.hpp>
#include <utility>

#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kFirstBoot = 42;

// Returns whether an outcome is true for a command that has had `effects` effects.
bool Agrees(const S& outcome, int effects) {
  switch (outcome.state) {
    case S::STATE_SUCCEEDED:
      return effects == 1;
    case S::STATE_INDETERMINATE:
      if (outcome.finding == S::FINDING_EFFECT_SEEN) return effects == 1;
      if (outcome.finding == S::FINDING_NO_EFFECT_SEEN) return effects == 0;
      return true;
    default:
      return effects == 0;
  }
}

}  // namespace

World::World(WorldSettings settings)
    : settings_(settings), random_(settings.seed), network_(settings.network, clock_, random_) {
  machine_.machine = "world";
  machine_.bridge.allow_unsigned = true;
  for (int bus = 0; bus < settings.buses; ++bus) {
    std::vector<std::string> devices;
    devices.reserve(static_cast<std::size_t>(settings.devices_per_bus));
    for (int device = 0; device < settings.devices_per_bus; ++device) {
      devices.push_back("axis" + std::to_string(bus) + "-" + std::to_string(device));
    }
    machine_.buses.push_back(CountingBus("b" + std::to_string(bus), devices));
  }
  if (settings.traced) Trace();
  for (const BusConfig& bus : machine_.buses) {
    drivers_[bus.name] = std::make_unique<WorldDriver>(bus, machine_.bridge, network_, clock_, random_, devices_);
  }
}

void World::Trace() {
  store_.trace = &trace_;
  network_.on_sent = [this](const std::string& channel, Bytes message) { trace_.OnMessage(channel, message); };
  devices_.on_start = [this](std::int64_t boot_id) { trace_.DriverStarted(boot_id); };
  devices_.on_effect = [this](const CommandId& id) { trace_.Add("effect", id); };
}

bool World::Run(std::uint32_t count) {
  const auto buses = static_cast<std::size_t>(settings_.buses);
  const std::size_t at_a_time = 2 * buses * static_cast<std::size_t>(settings_.devices_per_bus);
  for (int i = 0; i < 2'500; ++i) Millisecond();  // the drivers send HELLO
  std::uint32_t started = 0;
  MonoNs settled = kNever;
  for (std::int64_t i = 0; i < 200'000'000; ++i) {
    while (started < count && open_.size() < at_a_time) StartOne(started++);
    Millisecond();
    std::erase_if(open_, [](const auto& entry) { return !entry.second->session || entry.second->session->done(); });
    if (started < count || !open_.empty() || !bridge_ || !store_.Open().empty()) {
      settled = kNever;
    } else if (settled == kNever) {
      settled = clock_.now + 2 * kSecond;  // what is still under way arrives
    } else if (clock_.now > settled) {
      return true;
    }
  }
  return false;
}

void World::StartOne(std::uint32_t number) {
  const CommandId id = NumberedId(number + 1);
  Client& client = clients_[id];
  client.note = "n" + std::to_string(number);
  client.reads = network_.Happens(settings_.reads);
  CommandRequest request;
  const BusConfig& bus = machine_.buses[number % machine_.buses.size()];
  request.device = bus.devices[random_() % bus.devices.size()].name;
  request.operation = client.reads ? "look" : "mark";
  if (!client.reads) request.arguments = {{"note", client.note}, {"page", "1"}};
  request.valid_ms = network_.Happens(settings_.short_lived)
                         ? std::uniform_int_distribution<std::int32_t>(1, 100)(random_)
                         : 20'000;
  const auto later = [&](int maximum) {
    return clock_.now + std::uniform_int_distribution<int>(0, maximum)(random_) * kMillisecond;
  };
  if (network_.Happens(settings_.cancels)) client.cancel_at = later(200);
  if (network_.Happens(settings_.client_kills)) client.kill_at = later(200);
  client.session.emplace(id, request, ClientKeys{}, clock_.now);
  open_[id] = &client;
}

void World::Advance(Client& client) {
  if (!client.session) return;
  if (clock_.now >= client.kill_at) {
    client.result = client.session->result();
    client.session.reset();
    return;
  }
  if (clock_.now >= client.cancel_at) client.session->Cancel(clock_.now);
  if (const auto body = client.session->Next(clock_.now)) {
    command_t envelope{};
    envelope.body = body->bytes;
    envelope.body_size = static_cast<std::int16_t>(envelope.body.size());
    network_.Publish("COMMAND", Encoded(envelope));
  }
  client.result = client.session->result();
}

void World::OnMessage(const std::string& channel, Bytes message) {
  if (channel == "COMMAND") return WithBridge([&] { bridge_->OnCommand(message, Now()); });
  if (channel.starts_with("DRIVER_STATUS/")) {
    return WithBridge([&] { bridge_->OnDriverStatus(channel, message, Now()); });
  }
  if (channel.starts_with("DRIVER_COMMAND/")) return drivers_.at(channel.substr(15))->OnMessage(message);
  if (channel != "COMMAND_STATUS") return;
  WithBridge([&] { bridge_->OnCommandStatus(message, Now()); });
  if (const auto status = DecodeMessage<S>(message)) OnStatus(*status);
}

void World::OnStatus(const S& status) {
  const auto found = clients_.find(IdOf(status.id));
  if (found == clients_.end()) return;
  if (status.is_final != 0) found->second.outcomes.insert(status.state);
  if (!found->second.session) return;
  found->second.session->OnStatus(status, clock_.now);
  found->second.result = found->second.session->result();
}

void World::Millisecond() {
  clock_.now += kMillisecond;
  network_.Deliver([this](const std::string& channel, Bytes message) { OnMessage(channel, message); });
  for (auto& [name, driver] : drivers_) {
    if (network_.Happens(settings_.driver_kills_per_s / 1'000)) driver->Restart();
    driver->Step();
  }
  for (auto& [id, client] : open_) Advance(*client);
  if (network_.Happens(settings_.bridge_kills_per_s / 1'000) && bridge_) KillBridge();
  if (!bridge_ && clock_.now >= bridge_starts_) StartBridge();
  if (clock_.now / kMillisecond % 10 == 0) WithBridge([&] { bridge_->Tick(Now()); });
}

void World::StartBridge() {
  bridge_starts_ = clock_.now + 300 * kMillisecond;
  try {
    journal_ = std::make_unique<InlineJournal>(faulty_store_);
    bridge_ = std::make_unique<Dispatcher>(machine_, Origin{.boot_id = kFirstBoot + bridge_boots_++},
                                           BridgePorts{.journal = journal_.get(),
                                                       .commands = &faulty_sink_,
                                                       .data = &network_,
                                                       .key = nullptr,
                                                       .log = [](const std::string&) {},
                                                       .random = [] { return CommandId{}; }},
                                           Now());
  } catch (const Killed&) {
    KillBridge();
  }
}

template <typename Work>
void World::WithBridge(const Work& work) {
  if (!bridge_) return;
  try {
    work();
  } catch (const Killed&) {
    KillBridge();
  }
}

// What it has sent is still under way for a while when the next one listens.
void World::KillBridge() {
  if (settings_.traced) trace_.BridgeKilled();
  bridge_.reset();
  bridge_starts_ = clock_.now + 300 * kMillisecond;
}

WorldTally World::Judge() const {
  WorldTally tally;
  tally.bridge_kills = static_cast<int>(bridge_boots_) - 1;
  for (const auto& [name, driver] : drivers_) tally.driver_kills += driver->restarts;
  for (const auto& [id, client] : clients_) JudgeOne(id, client, tally);
  return tally;
}

void World::JudgeOne(const CommandId& id, const Client& client, WorldTally& tally) const {
  const auto breach = [&](const std::string& what) { tally.breaches.push_back(IdText(id) + ": " + what); };
  const auto marks = devices_.marks.find(client.note);
  const int effects = marks == devices_.marks.end() ? 0 : marks->second;
  tally.effects += effects;
  if (effects > 1) breach("done " + std::to_string(effects) + " times");
  if (client.outcomes.size() > 1 && !client.reads) {
    std::string told;
    for (const int state : client.outcomes) told += " " + std::string(StateName(static_cast<std::int8_t>(state)));
    breach("reported more than one outcome:" + told);
  }
  const auto journalled = store_.Find(id);
  if (client.reads) return void(++tally.outcomes["read"]);
  if (!journalled) {
    ++tally.outcomes["never accepted"];
    if (effects != 0) breach("done, and not in the journal");
    return;
  }
  if (journalled->is_final == 0) return breach("no outcome in the journal");
  ++tally.outcomes[std::string(StateName(journalled->state))];
  if (journalled->state != S::STATE_SUCCEEDED) ++tally.reasons[std::string(ReasonName(journalled->reason_code))];
  if (!Agrees(*journalled, effects)) {
    breach(std::string(StateName(journalled->state)) + " " + std::string(FindingName(journalled->finding)) +
           " with " + std::to_string(effects) + " effects: " + journalled->text);
  }
  const CommandResult& result = client.result;
  if (result.not_accepted) breach("its client received that no bridge took it up");
  if (result.answered && result.status.is_final != 0 && result.status.state != journalled->state) {
    breach("its client received " + std::string(StateName(result.status.state)));
  }
}

}  // namespace axlecast
