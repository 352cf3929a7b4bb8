#include "tests/command_simulation/world_driver.h"

#include <axlecast/command_status_t.hpp>
#include <utility>
#include <vector>

namespace axlecast {
namespace {

std::string ArgumentOf(const Arguments& arguments, std::string_view key) {
  for (const auto& [name, value] : arguments) {
    if (name == key) return value;
  }
  return "";
}

// "mark note=n17 page=1" is "n17"
std::string NoteOf(const std::string& command_line) {
  const std::size_t begin = command_line.find("note=");
  if (begin == std::string::npos) return "";
  const std::size_t end = command_line.find(' ', begin);
  return command_line.substr(begin + 5, end == std::string::npos ? end : end - begin - 5);
}

}  // namespace

WorldDriver::WorldDriver(const BusConfig& bus, const BridgeConfig& bridge, WorldNetwork& network, WorldClock& clock,
                         std::mt19937& random, WorldDevices& devices)
    : bus_(bus),
      bridge_(bridge),
      network_(network),
      clock_(clock),
      random_(random),
      devices_(devices),
      sink_(network, faults) {
  Restart();
  restarts = 0;
}

void WorldDriver::Restart() {
  static std::int64_t boots = 100;
  ++restarts;
  jobs_.clear();
  desk_ = std::make_unique<DriverCommandServer>(
      bus_, bridge_,
      DriverCommandServer::Context{
          .origin = {.boot_id = ++boots}, .clock = &clock_, .sink = &sink_, .wake = [] {}, .key = nullptr});
  devices_.on_start(boots);
  next_hello_ = clock_.now + 100 * kMillisecond;
}

template <typename Work>
void WorldDriver::Alive(const Work& work) {
  try {
    work();
  } catch (const Killed&) {
    Restart();
  }
}

void WorldDriver::OnMessage(Bytes message) {
  Alive([&] { desk_->OnDriverCommand(message); });
}

void WorldDriver::Step() {
  Alive([&] {
    if (clock_.now >= next_hello_) Hello();
    while (auto taken = desk_->Take()) Begin(*taken);
    while (auto cancel = desk_->TakeCancel()) Cancel(*cancel);
    for (auto job = jobs_.begin(); job != jobs_.end();) {
      Advance(job->first, job->second);
      job = clock_.now >= job->second.done ? jobs_.erase(job) : std::next(job);
    }
  });
}

void WorldDriver::Hello() {
  next_hello_ = clock_.now + kSecond;
  std::vector<driver_device_t> devices;
  for (const DeviceConfig& device : bus_.devices) {
    devices.push_back({});
    devices.back().device = device.name;
    devices.back().state = 1;
  }
  desk_->Hello(devices);
}

void WorldDriver::Begin(const DriverCommandServer::Taken& taken) {
  const DriverCommand& order = taken.command;
  Job job{.device = taken.device, .operation = order.operation, .touch = clock_.now + RandomMs(20)};
  job.note = order.operation == "look" ? NoteOf(ArgumentOf(order.arguments, "after"))
                                       : ArgumentOf(order.arguments, "note");
  job.done = job.touch + RandomMs(40);
  const bool refuses = order.operation == "mark" && network_.Happens(0.1);
  job.outcome.state = refuses ? CommandState::kRejected : CommandState::kSucceeded;
  job.touched = refuses;
  jobs_[order.id] = job;
}

// Reports what the device held before, touches it, and reports the outcome, each at its time.
void WorldDriver::Advance(const CommandId& id, Job& job) {
  if (!job.told && job.operation == "mark") {
    job.told = true;
    desk_->Report(job.device, id, {.changes = {{"note", devices_.note[job.device], ""}}}, 0);
  }
  if (!job.touched && clock_.now >= job.touch) Touch(id, job);
  if (clock_.now >= job.done) desk_->Report(job.device, id, job.outcome, 0);
}

void WorldDriver::Touch(const CommandId& id, Job& job) {
  job.touched = true;
  std::string& note = devices_.note[job.device];
  if (job.operation == "look") {
    job.outcome.changes = {{"note", "", note},
                           {"finding", "", note == job.note ? "reads_as_after" : "no_effect_seen"}};
    return;
  }
  faults.Pass();
  const bool works = job.operation == "mark" && !network_.Happens(0.1);
  if (works) {
    note = job.note;
    ++devices_.marks[job.note];
    devices_.on_effect(id);
  }
  faults.Pass();
  job.outcome.state = works || job.operation != "mark" ? CommandState::kSucceeded : CommandState::kFailed;
  job.outcome.verified = works;
}

void WorldDriver::Cancel(const DriverCommandServer::Taken& cancel) {
  const auto job = jobs_.find(cancel.command.id);
  if (job == jobs_.end() || job->second.touched) return;
  desk_->Report(job->second.device, job->first, {.state = CommandState::kCancelled}, 0);
  jobs_.erase(job);
}

}  // namespace axlecast
