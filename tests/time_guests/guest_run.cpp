#include "tests/time_guests/guest_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/messages/message.h"
#include "platform/os/mapped_file.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

Result<ClockLog> ReadPage(const std::filesystem::path& path) {
  const ClockPage* page = MapClockPage(path.c_str());
  if (page == nullptr) return Failure("cannot map " + path.string());
  ClockLog log;
  const std::int64_t count = page->count;
  for (std::int64_t i = 0; i < count; ++i) {
    ClockReading reading = page->readings[i];
    reading.before -= kCounterError;
    reading.after += kCounterError;
    log.Add(reading);
  }
  if (log.readings().size() < 2) return Failure("no readings in " + path.string());
  return log;
}

// Every pin contains the same constant.
Result<Bounds> ReadPins(const std::filesystem::path& path) {
  std::ifstream file(path);
  Bounds all = {INT64_MIN, INT64_MAX};
  Bounds pin;
  while (file >> pin.lowest >> pin.highest) {
    all = {std::max(all.lowest, pin.lowest), std::min(all.highest, pin.highest)};
  }
  if (all.lowest == INT64_MIN) return Failure("no pins in " + path.string());
  if (all.lowest > all.highest) {
    return Failure("the pins of " + path.string() +
                   " contradict each other: the counter of this guest is not that of "
                   "its host minus a constant");
  }
  return all;
}

Result<> ReadMessages(Guest& guest, const std::filesystem::path& path) {
  constexpr std::string_view kPosition = "POSITION/";
  const MappedFile file(path.string());
  if (!file.problem().empty()) return Failure(file.problem());
  LogReader log(file.bytes());
  while (const auto event = log.Next()) {
    const MonoNs received = event->utime * kMicrosecond;
    if (auto time = DecodeMessage<time_quality_t>(event->data)) {
      guest.messages.push_back({received, std::move(*time)});
    } else if (auto set = DecodeMessage<position_set_t>(event->data)) {
      guest.sets.push_back({received, std::move(*set)});
    } else if (auto position = DecodeMessage<position_t>(event->data)) {
      if (!event->channel.starts_with(kPosition)) continue;
      guest.positions.push_back({received, std::string(event->channel.substr(kPosition.size())), *position});
    }
  }
  return {};
}

std::vector<Guest::UtcClaim> ReadUtcClaims(const std::filesystem::path& path) {
  std::vector<Guest::UtcClaim> claims;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (const auto claim = ParseTracking(line)) claims.push_back(*claim);
  }
  return claims;
}

Result<Guest> ReadGuest(const std::filesystem::path& folder) {
  Guest guest;
  guest.name = folder.filename().string();
  guest.host = guest.name.substr(0, guest.name.find('-'));
  Result<ClockLog> clocks = ReadPage(folder / "page");
  if (!clocks) return Failure(clocks.error());
  const Result<Bounds> pins = ReadPins(folder / "pins");
  if (!pins) return Failure(pins.error());
  if (const Result<> read = ReadMessages(guest, folder / "messages.log"); !read) return Failure(read.error());
  auto shafts = ReadShaftLooks(folder / "shafts");
  if (!shafts) return Failure(shafts.error());
  guest.clocks = std::move(*clocks);
  guest.ticks_ahead = *pins;
  guest.shafts = std::move(*shafts);
  guest.utc_claims = ReadUtcClaims(folder / "chrony.csv");
  Identify(guest);
  return guest;
}

Result<std::vector<TestEvent>> ReadEvents(const std::filesystem::path& path) {
  static constexpr std::array<std::pair<std::string_view, TestEvent::Kind>, 5> kKinds = {{
      {"phase", TestEvent::Kind::kPhase},
      {"withdraw", TestEvent::Kind::kWithdraw},
      {"resume", TestEvent::Kind::kResume},
      {"beyond", TestEvent::Kind::kBeyond},
      {"within", TestEvent::Kind::kWithin},
  }};
  std::ifstream file(path);
  std::vector<TestEvent> events;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    TestEvent event;
    std::string kind;
    words >> event.at >> kind >> std::ws;
    std::getline(words, event.text);
    const auto* const known =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& each) { return each.first == kind; });
    if (known == kKinds.end()) return Failure("unknown event in " + path.string() + ": " + line);
    event.kind = known->second;
    events.push_back(event);
  }
  return events;
}

}  // namespace

const Guest* GuestRun::Root(std::int64_t base_id) const {
  const auto found = std::find_if(guests.begin(), guests.end(),
                                  [&](const Guest& guest) { return guest.own_base_id == base_id && base_id != 0; });
  return found == guests.end() ? nullptr : &*found;
}

std::optional<Bounds> GuestRun::BaseAt(std::int64_t base_id, const Bounds& host_ticks) const {
  const Guest* root = Root(base_id);
  if (root == nullptr) return std::nullopt;
  return root->clocks.At(ClockLog::Clock::kRaw, OnGuest(*root, host_ticks));
}

std::string GuestRun::PhaseAt(MonoNs time) const {
  std::string phase;
  for (const TestEvent& event : events) {
    if (event.kind == TestEvent::Kind::kPhase && (phase.empty() || event.at <= time)) phase = event.text;
  }
  return phase;
}

// The fields of chronyc 4.3: 4 is the correction that is still to be made, 10 the root delay, 11 the root dispersion, in s.
std::optional<Guest::UtcClaim> ParseTracking(const std::string& line) {
  std::istringstream text(line);
  std::vector<std::string> fields;
  for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
  if (fields.size() != 15 || fields.back() == "Not synchronised") return std::nullopt;
  const auto ns = [&](std::size_t field) { return std::strtod(fields[field].c_str(), nullptr) * 1e9; };
  return Guest::UtcClaim{std::llround(ns(0)), std::llround(std::abs(ns(5)) + ns(12) + ns(11) / 2)};
}

void Identify(Guest& guest) {
  for (const Guest::Message& message : guest.messages) {
    if (message.time.host != guest.host) continue;
    guest.clock_id = message.time.clock_id;
    if (message.time.source == time_quality_t::SOURCE_SELF) guest.own_base_id = message.time.base_id;
  }
}

Result<GuestRun> ReadGuestRun(const std::string& folder) {
  GuestRun run;
  Result<ClockLog> host = ReadPage(std::filesystem::path(folder) / "host.page");
  if (!host) return Failure(host.error());
  run.host = std::move(*host);
  Result<std::vector<TestEvent>> events = ReadEvents(std::filesystem::path(folder) / "events");
  if (!events) return Failure(events.error());
  run.events = std::move(*events);
  std::vector<std::filesystem::path> places;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_directory() && exists(entry.path() / "messages.log")) places.push_back(entry.path());
  }
  std::sort(places.begin(), places.end());
  for (const std::filesystem::path& place : places) {
    Result<Guest> guest = ReadGuest(place);
    if (!guest) return Failure(guest.error());
    run.guests.push_back(std::move(*guest));
  }
  if (run.guests.size() < 2) return Failure("fewer than two guests in " + folder);
  return run;
}

}  // namespace axlecast
