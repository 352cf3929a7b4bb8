#include "bridge/store/rows.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

// `list`: LCM messages.
template <typename Message>
std::string Dump(const std::vector<Message>& list) {
  return Field(list).dump(-1, ' ', false, Json::error_handler_t::replace);
}

// The list's objects; empty when `text` is no list.
Json Parse(std::string_view text) {
  Json json = Json::parse(text, nullptr, false);
  return json.is_array() ? json : Json::array();
}

std::string Member(const Json& object, const char* name) {
  if (!object.is_object()) return "";
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

std::vector<argument_t> ParseArguments(std::string_view text) {
  std::vector<argument_t> arguments;
  for (const Json& object : Parse(text)) {
    arguments.emplace_back();
    arguments.back().key = Member(object, "key");
    arguments.back().value = Member(object, "value");
  }
  return arguments;
}

void SetBytes(const std::string& hex, std::uint8_t (&bytes)[16]) {
  const CommandId parsed = ParseId(hex).value_or(CommandId{});
  std::copy(parsed.begin(), parsed.end(), std::begin(bytes));
}

}  // namespace

CommandRow CommandOf(const Rows& row) {
  CommandRow command;
  CommandRecord& record = command.record;
  command_status_t& status = record.status;
  int column = 0;
  const auto integer = [&](auto& field) {
    field = static_cast<std::remove_reference_t<decltype(field)>>(row.Integer(column++));
  };
  integer(command.number);
  SetBytes(row.Text(column++), status.id);
  integer(record.utime);
  integer(record.begin_by_utime);
  status.device = row.Text(column++);
  status.operation = row.Text(column++);
  record.arguments = ParseArguments(row.Text(column++));
  record.reason = row.Text(column++);
  record.who = row.Text(column++);
  integer(record.key_id);
  integer(status.is_unsigned);
  integer(status.body_digest);
  integer(record.bridge_boot_id);
  integer(status.driver_boot_id);
  integer(command.sent_epoch);
  integer(status.state);
  integer(status.verified);
  integer(status.finding);
  integer(status.reason_code);
  status.text = row.Text(column++);
  status.progress = static_cast<float>(row.Real(column++));
  SetBytes(row.Text(column++), status.token);
  integer(status.started_utime);
  integer(status.finished_utime);
  integer(status.epoch_after);
  status.changes = ParseChanges(row.Text(column++));
  status.n_changes = static_cast<std::int8_t>(status.changes.size());
  status.is_final = IsFinalState(status.state) ? 1 : 0;
  return command;
}

std::string ArgumentsText(const std::vector<argument_t>& arguments) { return Dump(arguments); }

std::string ChangesText(const std::vector<change_t>& changes) { return Dump(changes); }

std::vector<change_t> ParseChanges(std::string_view text) {
  std::vector<change_t> changes;
  for (const Json& object : Parse(text)) {
    if (changes.size() == INT8_MAX) break;
    changes.emplace_back();
    changes.back().key = Member(object, "key");
    changes.back().before = Member(object, "before");
    changes.back().after = Member(object, "after");
  }
  return changes;
}

std::string TokenText(const command_status_t& status) {
  const CommandId token = IdOf(status.token);
  return token == CommandId{} ? "" : IdText(token);
}

DatumRecord DatumOf(const Rows& row, int first_column) {
  DatumRecord datum;
  datum.number = row.Integer(first_column);
  datum.counts = row.Integer(first_column + 1);
  datum.utime = row.Integer(first_column + 2);
  datum.identity = row.Text(first_column + 3);
  datum.value = row.Text(first_column + 4);
  datum.who = row.Text(first_column + 5);
  datum.command = ParseId(row.Text(first_column + 6)).value_or(CommandId{});
  datum.reason = row.Text(first_column + 7);
  if (row.IsNull(first_column + 8)) return datum;
  datum.voided_utime = row.Integer(first_column + 8);
  datum.void_reason = row.Text(first_column + 9);
  return datum;
}

AxisRecord AxisOf(const Rows& row, int first_column) {
  AxisRecord axis;
  axis.identity = row.Text(first_column);
  axis.reference_lost = row.Integer(first_column + 1) != 0;
  axis.writes = row.Integer(first_column + 2);
  axis.since_utime = row.Integer(first_column + 3);
  if (!row.IsNull(first_column + 4)) {
    axis.position = LastPosition{row.Integer(first_column + 4), row.Integer(first_column + 5)};
  }
  if (!row.IsNull(first_column + 6)) axis.datum = DatumOf(row, first_column + 6);
  return axis;
}

}  // namespace axlecast
