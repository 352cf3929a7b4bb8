#include "tests/simulation/operators.h"

#include <axlecast/command_t.hpp>
#include <utility>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast::simulation {
namespace {

using S = command_status_t;

std::string NameOf(const CommandId& id, const std::string& device, const std::string& operation) {
  return IdText(id) + " " + operation + " " + device;
}

}  // namespace

Operators::Operators(Schedule& schedule, Host& host, Network& network, Promises& promises, DriverOf driver_of,
                     std::uint64_t seed)
    : schedule_(schedule),
      host_(host),
      port_(network, host, Port::kCommands),
      promises_(promises),
      driver_of_(std::move(driver_of)),
      random_(seed, 5),
      orders_({{"spindle", "clear_errors", "error_clears"},
               {"clamp", "zero_single_turn", "zeroings"},
               {"joint1", "zero", "zeroings"},
               {"hoist", "zero", "writes"},
               {"boom", "zero", "zeroings"},
               {"gantry", "set_datum", "", true},
               {"turntable", "set_datum", "", true},
               {"spindle", "set_datum", "", true},
               {"spindle", "read_all"},
               {"joint2", "read_position"},
               {"winch", "read_position"},
               {"conveyor", "read_state"},
               {.device = "winch", .operation = "shelve_alarm", .shelves = true}}) {
  network.Join(host, Port::kCommands, [this](const std::string& channel, Bytes message) {
    if (channel == "COMMAND_STATUS") OnStatus(message);
  });
  Cycle();
}

void Operators::Command(MonoNs patience, bool cancels) {
  Send(orders_[random_.Index(orders_.size())], patience, cancels);
}

void Operators::ShelveInventedAlarms(int number) {
  for (int alarm = 0; alarm < number; ++alarm) Send(orders_.back(), kNever, false);
}

void Operators::Send(const Order& order, MonoNs patience, bool cancels) {
  const CommandId id = random_.Id();
  Client& client = clients_[id];
  client.order = &order;
  CommandRequest request;
  request.device = order.device;
  request.operation = order.operation;
  request.valid_ms = random_.Happens(0.3) ? 50 : 20'000;
  client.counts = ++sent_;
  if (order.sets_datum) request.arguments = {{"counts", std::to_string(client.counts)}};
  // None ends during the run, for any step of a clock.
  if (order.shelves)
    request.arguments = {
        {"alarm", "invented_" + std::to_string(client.counts)}, {"seconds", "43200"}, {"up_to", "error"}};
  if (patience != kNever) (cancels ? client.cancel_at : client.die_at) = schedule_.now() + patience;
  client.session.emplace(id, request, ClientKeys{}, host_.clock.Now());
  open_[id] = &client;
  promises_.Count("commands");
}

std::size_t Operators::open() const { return open_.size(); }

void Operators::OnStatus(Bytes message) {
  const auto status = DecodeMessage<S>(message);
  if (!status) return promises_.Breach("a COMMAND_STATUS that cannot be decoded");
  const auto found = clients_.find(IdOf(status->id));
  if (found == clients_.end()) return;
  Client& client = found->second;
  if (status->is_final != 0) client.outcomes.insert(status->state);
  if (status->text.ends_with("the journal has not noted it")) client.not_noted = true;
  if (!client.session) return;
  client.session->OnStatus(*status, host_.clock.Now());
  client.result = client.session->result();
}

void Operators::Cycle() {
  for (auto& [id, client] : open_) Advance(*client);
  std::erase_if(open_, [](const auto& entry) { return !entry.second->session || entry.second->session->done(); });
  schedule_.After(kCycle, [this] { Cycle(); });
}

void Operators::Advance(Client& client) {
  if (!client.session) return;
  if (schedule_.now() >= client.die_at) {
    client.result = client.session->result();
    client.session.reset();
    return;
  }
  if (schedule_.now() >= client.cancel_at) client.session->Cancel(host_.clock.Now());
  if (const auto body = client.session->Next(host_.clock.Now())) {
    command_t envelope{};
    envelope.body = body->bytes;
    envelope.body_size = static_cast<std::int16_t>(envelope.body.size());
    port_.Publish("COMMAND", Encoded(envelope));
  }
  client.result = client.session->result();
}

Operators::Bounds Operators::DoneBy(const command_status_t& status) {
  switch (status.state) {
    case S::STATE_SUCCEEDED:
      return {1, 1};
    case S::STATE_FAILED:
      return {0, 1};
    case S::STATE_INDETERMINATE:
      return {status.finding == S::FINDING_EFFECT_SEEN ? 1 : 0,
              status.finding == S::FINDING_NO_EFFECT_SEEN ? 0 : 1};
    default:
      return {0, 0};
  }
}

void Operators::Judge(DurableStore& journal) {
  std::map<const Order*, Bounds> done;
  for (const Order& order : orders_) done[&order] = {};
  for (const auto& [id, client] : clients_) {
    const auto journalled = journal.Find(id);
    const bool reads = client.order->counter.empty() && !client.order->sets_datum;
    if (!journalled) {
      promises_.Count("commands never accepted, or reads");
      for (const int state : client.outcomes) {
        // Nothing was done, and nothing will be.
        const bool void_of_effect =
            state == S::STATE_REJECTED || state == S::STATE_EXPIRED || state == S::STATE_CANCELLED;
        if (!reads && !void_of_effect)
          promises_.Breach(NameOf(id, client.order->device, client.order->operation) + ": ended as " +
                           std::string(StateName(static_cast<std::int8_t>(state))) + " and is not in the journal");
      }
      continue;
    }
    JudgeOutcome(id, client, *journalled);
    const Bounds by = DoneBy(*journalled);
    done[client.order].least += by.least;
    done[client.order].most += by.most;
    if (client.order->sets_datum) JudgeDatum(id, client, *journalled, journal);
  }
  for (const auto& [order, bounds] : done) {
    if (order->counter.empty()) continue;
    const std::int64_t counted = std::stoll(driver_of_(order->device).Quantity(order->device, order->counter));
    promises_.Count("effects on devices", counted);
    if (counted < bounds.least || counted > bounds.most)
      promises_.Breach(Text("%s %s was done %lld times; the outcomes state %lld to %lld", order->operation.c_str(),
                            order->device.c_str(), static_cast<long long>(counted),
                            static_cast<long long>(bounds.least), static_cast<long long>(bounds.most)));
  }
}

void Operators::JudgeOutcome(const CommandId& id, const Client& client, const command_status_t& journalled) {
  const std::string name = NameOf(id, client.order->device, client.order->operation);
  // A power failure may take what the journal has not noted. It is indeterminate then, and the outcome has stated it.
  if (client.not_noted && client.outcomes.size() <= 2 && journalled.state == S::STATE_INDETERMINATE) {
    promises_.Count("outcomes that the journal had not noted, and lost");
    return;
  }
  if (client.outcomes.size() > 1) promises_.Breach(name + ": more than one outcome was reported");
  if (journalled.is_final == 0) return promises_.Breach(name + ": has no outcome in the journal");
  if (journalled.state == S::STATE_INDETERMINATE && journalled.finding == S::FINDING_NONE)
    promises_.Breach(name + ": has no finding in the journal");
  promises_.Count("commands that ended as " + std::string(StateName(journalled.state)));
  if (client.result.not_accepted) promises_.Breach(name + ": its client learned that no bridge took it up");
  if (client.result.answered && client.result.status.is_final != 0 &&
      client.result.status.state != journalled.state)
    promises_.Breach(name + ": its client received another outcome than the journal has");
}

void Operators::JudgeDatum(const CommandId& id, const Client& client, const command_status_t& journalled,
                           DurableStore& journal) {
  const Bounds done = DoneBy(journalled);
  std::int64_t found = 0;
  for (const DatumRecord& datum : journal.Datums(client.order->device)) {
    if (datum.counts == client.counts) ++found;
  }
  if (found >= done.least && found <= done.most) return;
  promises_.Breach(NameOf(id, client.order->device, client.order->operation) + ": its datum is " +
                   std::to_string(found) + " times in the journal; it ended as " +
                   std::string(StateName(journalled.state)) + " " + std::string(FindingName(journalled.finding)) +
                   ", " + journalled.text);
}

}  // namespace axlecast::simulation
