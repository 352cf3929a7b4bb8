#include "tools/axlecast/live/format_counts.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <numeric>
#include <string_view>

#include "core/base/text.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;
using NameOfState = std::string_view (*)(std::int8_t);

// What is as it should be comes first, then the worse states.
constexpr std::array<std::int8_t, MachineCounts::kStates> kOrder = {
    device_info_t::STATE_ONLINE, device_info_t::STATE_DEGRADED, device_info_t::STATE_OFFLINE,
    device_info_t::STATE_STARTING};

void AddPart(std::string& text, std::size_t count, std::string_view name) {
  if (count == 0) return;
  text += (text.empty() ? "" : ", ") + std::to_string(count) + ' ' + std::string(name);
}

// "devices                  300: 298 ONLINE, 1 OFFLINE, 1 SILENT"
std::string Row(std::string_view title, std::size_t total, const std::string& parts) {
  return Left(title, 24) + ' ' + std::to_string(total) + (parts.empty() ? "" : ": " + parts) + '\n';
}

std::string StatesRow(std::string_view title, const MachineCounts::States& states, NameOfState name) {
  std::string parts;
  for (const std::int8_t state : kOrder) AddPart(parts, states.of[static_cast<std::uint8_t>(state)], name(state));
  AddPart(parts, states.silent, "SILENT");
  return Row(title, states.total, parts);
}

std::string AlarmsRow(const MachineCounts::Alarms& alarms) {
  std::string parts;
  for (std::size_t severity = alarms.of.size(); severity-- > 0;)
    AddPart(parts, alarms.of[severity], SeverityName(static_cast<std::int8_t>(severity)));
  AddPart(parts, alarms.shelved, "shelved");
  return Row("alarms", std::accumulate(alarms.of.begin(), alarms.of.end(), alarms.shelved), parts);
}

std::string HostsRow(const MachineCounts::Hosts& hosts) {
  if (hosts.total == 0) return "";
  std::string parts;
  AddPart(parts, hosts.claims, "with a claim of the time base");
  AddPart(parts, hosts.silent, "SILENT");
  return Row("hosts", hosts.total, parts);
}

std::string LowerCase(std::string_view name) {
  std::string text(name);
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

Json StatesJson(const MachineCounts::States& states, NameOfState name) {
  Json json = {{"total", states.total}};
  for (const std::int8_t state : kOrder) json[LowerCase(name(state))] = states.of[static_cast<std::uint8_t>(state)];
  json["silent"] = states.silent;
  return json;
}

}  // namespace

std::string CountsText(const MachineCounts& counts) {
  return StatesRow("devices", counts.devices, &DeviceStateName) + StatesRow("buses", counts.buses, &BusStateName) +
         HostsRow(counts.hosts) + AlarmsRow(counts.alarms);
}

Json CountsJson(const MachineCounts& counts) {
  Json alarms = Json::object();
  for (std::size_t severity = counts.alarms.of.size(); severity-- > 0;)
    alarms[std::string(SeverityName(static_cast<std::int8_t>(severity)))] = counts.alarms.of[severity];
  alarms["shelved"] = counts.alarms.shelved;
  return {
      {"devices", StatesJson(counts.devices, &DeviceStateName)},
      {"buses", StatesJson(counts.buses, &BusStateName)},
      {"hosts", {{"total", counts.hosts.total}, {"silent", counts.hosts.silent}, {"claims", counts.hosts.claims}}},
      {"alarms", std::move(alarms)}};
}

}  // namespace axlecast
