#include "bridge/command_world.h"

#include <gtest/gtest.h>

#include <array>

#include "drivers/runtime/command/body_digest.h"
#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/core/decode_message.h"

namespace axlecast {

using S = command_status_t;

constexpr std::int64_t kBridgeBoot = 42;

World::World(WorldSettings settings)
    : settings_(settings), random_(settings.seed), network_(settings_, clock_, random_) {
  machine_.machine = "world";
  machine_.bridge.allow_unsigned = true;
  for (int bus = 0; bus < settings.buses; ++bus) {
    std::vector<std::string> devices;
    for (int device = 0; device < settings.devices_per_bus; ++device) {
      devices.push_back("axis" + std::to_string(bus) + "-" + std::to_string(device));
    }
    machine_.buses.push_back(CountingBus("b" + std::to_string(bus), devices));
  }
  for (const BusConfig& bus : machine_.buses) {
    drivers_[bus.name] = std::make_unique<WorldDriver>(bus, network_, clock_, random_, effects);
  }
  bridge_ = std::make_unique<Dispatcher>(machine_, kBridgeBoot,
                                         BridgePorts{.store = &store_,
                                                     .commands = &network_,
                                                     .data = &network_,
                                                     .log = [](const std::string&) {},
                                                     .random = [] { return CommandId{}; }},
                                         Now());
}

bool World::Run(std::uint32_t count) {
  const std::size_t at_a_time = static_cast<std::size_t>(2 * settings_.buses * settings_.devices_per_bus);
  for (int i = 0; i < 2'500; ++i) Millisecond();  // the drivers say HELLO
  std::uint32_t started = 0;
  for (int i = 0; i < 20'000'000; ++i) {
    while (started < count && open_.size() < at_a_time) StartOne(started++);
    Millisecond();
    std::erase_if(open_, [](const auto& entry) { return entry.second->IsDone(); });
    if (started == count && open_.empty()) return true;
  }
  return false;
}

void World::StartOne(std::uint32_t number) {
  const CommandId id = NumberedId(number);
  WorldClient& client = clients[id];
  std::copy(id.begin(), id.end(), std::begin(client.body.id));
  client.body.bridge_boot_id = kBridgeBoot;
  client.body.issued_mono_ns = clock_.now;
  client.body.valid_ms = 20'000;
  if (network_.Happens(settings_.short_lived)) {
    client.body.valid_ms = std::uniform_int_distribution<std::int32_t>(1, 100)(random_);
  }
  const BusConfig& bus = machine_.buses[number % machine_.buses.size()];
  client.body.device = bus.devices[random_() % bus.devices.size()].name;
  client.body.operation = "bump";
  client.body.expect_epoch = -1;
  client.encoded = Encoded(client.body);
  client.started = client.next_send = clock_.now;
  if (network_.Happens(settings_.cancels)) {
    client.cancel_at = clock_.now + std::uniform_int_distribution<int>(0, 200)(random_) * kMillisecond;
  }
  open_[id] = &client;
}

void World::SendDue(WorldClient& client) {
  if (clock_.now < client.next_send) return;
  client.next_send = clock_.now + (client.answered ? 500 : 50) * kMillisecond;
  command_body_t body = client.body;
  if (client.answered) body.mode = command_body_t::MODE_QUERY;
  if (client.answered && clock_.now >= client.cancel_at) body.mode = command_body_t::MODE_CANCEL;
  command_t envelope{};
  envelope.body = Encoded(body);
  envelope.body_size = static_cast<std::int16_t>(envelope.body.size());
  const auto bytes = Encoded(envelope);
  network_.Publish("COMMAND", bytes);
}

void World::OnMessage(const std::string& channel, Bytes message) {
  if (channel == "COMMAND") return bridge_->OnCommand(message, Now());
  if (channel.starts_with("DRIVER_STATUS/")) return bridge_->OnDriverStatus(channel, message, Now());
  if (channel.starts_with("DRIVER_COMMAND/")) return drivers_.at(channel.substr(15))->OnMessage(message);
  if (channel.starts_with("ALARM/")) return;
  const auto status = DecodeMessage<command_status_t>(message);
  ASSERT_TRUE(status);
  OnStatus(*status);
}

void World::OnStatus(const command_status_t& status) {
  const auto found = clients.find(IdOf(status.id));
  if (found == clients.end() || status.body_digest != BodyDigest(found->second.encoded)) return;
  WorldClient& client = found->second;
  client.answered = true;
  if (!status.is_final) return;
  if (!client.outcome || client.outcome->state != status.state) ++client.outcomes;
  if (!client.outcome || status.finding != S::FINDING_NONE) client.outcome = status;
}

void World::Millisecond() {
  clock_.now += kMillisecond;
  network_.Deliver([this](const std::string& channel, Bytes message) { OnMessage(channel, message); });
  for (auto& [name, driver] : drivers_) {
    if (network_.Happens(settings_.restarts_per_s / 1'000)) driver->Restart();
    driver->Step();
  }
  for (auto& [id, client] : open_) SendDue(*client);
  if (clock_.now / kMillisecond % 10 == 0) bridge_->Tick(Now());
}

namespace {

struct Tally {
  std::array<int, 10> by_state{};
  int effects = 0;
  int found = 0;
};

bool Agrees(const S& outcome, int effects) {
  if (outcome.state == S::STATE_SUCCEEDED || outcome.finding == S::FINDING_EFFECT_SEEN) return effects == 1;
  if (outcome.finding == S::FINDING_NO_EFFECT_SEEN) return effects == 0;
  return outcome.state == S::STATE_INDETERMINATE || effects == 0;
}

// The property: nothing twice, one outcome each, and each outcome agrees with what was really done.
Tally Judge(const World& world) {
  Tally tally;
  for (const auto& [id, client] : world.clients) {
    const auto found = world.effects.find(id);
    const int effects = found == world.effects.end() ? 0 : found->second;
    EXPECT_LE(effects, 1) << "done twice: " << IdText(id);
    EXPECT_EQ(client.outcomes, 1) << IdText(id);
    if (!client.outcome) continue;
    const S& outcome = *client.outcome;
    EXPECT_TRUE(Agrees(outcome, effects)) << IdText(id) << " " << StateName(outcome.state) << " "
                                          << FindingName(outcome.finding) << " " << outcome.text;
    ++tally.by_state[static_cast<std::size_t>(outcome.state)];
    tally.effects += effects;
    if (outcome.finding == S::FINDING_EFFECT_SEEN || outcome.finding == S::FINDING_NO_EFFECT_SEEN) ++tally.found;
  }
  for (std::size_t state = 0; state < tally.by_state.size(); ++state) {
    if (tally.by_state[state] == 0) continue;
    testing::Test::RecordProperty(std::string(StateName(static_cast<std::int8_t>(state))), tally.by_state[state]);
    std::printf("%s %d  ", std::string(StateName(static_cast<std::int8_t>(state))).c_str(), tally.by_state[state]);
  }
  std::printf("effects %d  found %d\n", tally.effects, tally.found);
  return tally;
}

TEST(CommandWorld, OnAGoodNetworkEverythingEndsAsTheDeviceSays) {
  World world({.seed = 1});
  ASSERT_TRUE(world.Run(2'000));
  const Tally tally = Judge(world);
  EXPECT_EQ(tally.by_state[S::STATE_SUCCEEDED], tally.effects);
  EXPECT_EQ(tally.by_state[S::STATE_INDETERMINATE], 0);
  EXPECT_GT(tally.by_state[S::STATE_FAILED], 100);
  EXPECT_GT(tally.by_state[S::STATE_REJECTED], 100);
}

TEST(CommandWorld, TenThousandThroughALossyNetwork) {
  World world({.seed = 2, .loss = 0.3, .duplication = 0.1, .max_delay_ms = 30, .cancels = 0.1, .short_lived = 0.1});
  ASSERT_TRUE(world.Run(10'000));
  const Tally tally = Judge(world);
  EXPECT_EQ(world.clients.size(), 10'000u);
  EXPECT_GT(tally.by_state[S::STATE_SUCCEEDED], 5'000);
  EXPECT_GT(tally.by_state[S::STATE_EXPIRED], 50);
  EXPECT_GT(tally.by_state[S::STATE_CANCELLED], 50);
}

TEST(CommandWorld, DriversThatDieAtAnyMoment) {
  World world({.seed = 3,
               .loss = 0.3,
               .duplication = 0.1,
               .max_delay_ms = 30,
               .restarts_per_s = 0.05,
               .cancels = 0.05,
               .short_lived = 0.05});
  ASSERT_TRUE(world.Run(3'000));
  const Tally tally = Judge(world);
  EXPECT_GT(tally.by_state[S::STATE_INDETERMINATE], 20);
}

TEST(CommandWorld, ANetworkThatAlmostFails) {
  World world({.seed = 4, .loss = 0.8, .duplication = 0.1, .max_delay_ms = 200, .buses = 2});
  ASSERT_TRUE(world.Run(500));
  Judge(world);
}

}  // namespace
}  // namespace axlecast
