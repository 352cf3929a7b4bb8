#include "tools/convert/conversion.h"

#include <algorithm>
#include <charconv>

#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kNames = "_names";

// Returns true for the names of one number's flags: a list of texts in "flag_names", "trip_factor_names[1]".
bool IsNames(const Json& value, std::string_view name) {
  return value.is_array() && name.substr(0, name.find('[', name.rfind('.') + 1)).ends_with(kNames) &&
         std::all_of(value.begin(), value.end(), [](const Json& word) { return word.is_string(); });
}

Json Joined(const Json& words) {
  std::string text;
  for (const Json& word : words) text += (text.empty() ? "" : " ") + word.get<std::string>();
  return text;
}

void Visit(const Json& value, std::string& name, const FieldVisitor& visit) {
  const std::size_t length = name.size();
  if (IsNames(value, name)) return visit(name, Joined(value));
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) {
      if (length > 0) name += '.';
      name += key;
      Visit(member, name, visit);
      name.resize(length);
    }
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      name += '[' + std::to_string(i) + ']';
      Visit(value[i], name, visit);
      name.resize(length);
    }
  } else {
    visit(name, value);
  }
}

// Removes "[12]" from the start of `rest`. Returns this element, or null.
const Json* TakeElement(const Json& list, std::string_view& rest) {
  std::size_t index = 0;
  const char* const end = rest.data() + rest.size();
  const auto [after, error] = std::from_chars(rest.data() + 1, end, index);
  if (error != std::errc() || after == end || *after != ']') return nullptr;
  rest.remove_prefix(static_cast<std::size_t>(after - rest.data()) + 1);
  return list.is_array() && index < list.size() ? &list[index] : nullptr;
}

}  // namespace

std::int64_t SampleTime(const LogEvent& event) {
  constexpr std::int64_t kYear10000 = 253'402'300'800'000'000;
  const std::int64_t received = std::clamp(event.utime, std::int64_t{0}, kYear10000 - 1);
  const std::optional<MessageHead> head = HeadOf(event.data);
  const std::int64_t utime = head ? head->utime : -1;
  return utime >= 0 && utime < kYear10000 ? utime : received;
}

void VisitFields(const Json& message, const FieldVisitor& visit) {
  std::string name;
  Visit(message, name, visit);
}

const Json* FindField(const Json& message, std::string_view name) {
  const Json* at = &message;
  while (at != nullptr && !name.empty()) {
    if (name.front() == '[') {
      at = TakeElement(*at, name);
      continue;
    }
    if (name.front() == '.') name.remove_prefix(1);
    const std::size_t size = std::min(name.find_first_of(".["), name.size());
    if (!at->is_object()) return nullptr;
    const auto member = at->find(std::string(name.substr(0, size)));
    at = member == at->end() ? nullptr : &*member;
    name.remove_prefix(size);
  }
  return at;
}

bool AlwaysSameFields(std::string_view schema) {
  bool same = true;
  const std::function<void(const Json&)> look = [&](const Json& part) {
    if (part.contains("anyOf")) same = false;
    if (part.value("type", Json()) == "array") {
      if (!part.contains("minItems")) same = false;
      look(part["items"]);
    }
    if (part.contains("properties")) {
      for (const auto& [name, member] : part["properties"].items()) {
        const Json* of_one = &member;  // all names of one number's flags are one value
        while (name.ends_with(kNames) && of_one->at("items").contains("items")) {
          if (!of_one->contains("minItems")) same = false;
          of_one = &of_one->at("items");
        }
        if (!name.ends_with(kNames)) look(member);
      }
    }
  };
  look(Json::parse(schema));
  return same;
}

}  // namespace axlecast
