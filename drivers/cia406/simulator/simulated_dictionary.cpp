#include "drivers/cia406/simulator/simulated_dictionary.h"

#include <algorithm>
#include <charconv>

namespace axlecast::cia406 {
namespace {

// Table 22.
constexpr std::uint32_t kReadOnlyObject = 0x06010002;
constexpr std::uint32_t kNoObject = 0x06020000;
constexpr std::uint32_t kTooLong = 0x06070012;
constexpr std::uint32_t kTooShort = 0x06070013;
constexpr std::uint32_t kNoSubIndex = 0x06090011;

constexpr const char* kHowToChange = "an object is changed by INDEX:SUB=VALUE or INDEX:SUB=none, e.g. 1017:00=500";

bool ReadNumber(std::string_view text, int base, std::uint32_t& into) {
  if (text.starts_with("0x")) {
    text.remove_prefix(2);
    base = 16;
  }
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), into, base);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

void SimulatedDictionary::AddRecord(std::uint16_t index, std::uint8_t highest_sub) {
  Add({.index = index, .sub = 0, .bytes = 1, .access = Access::kConstant, .value = highest_sub});
}

SimulatedDictionary::Found SimulatedDictionary::Read(std::uint16_t index, std::uint8_t sub) const {
  bool index_exists = false;
  for (const Object& object : objects_) {
    if (object.index != index) continue;
    if (object.sub == sub) return {&object, 0};
    index_exists = true;
  }
  return {nullptr, index_exists ? kNoSubIndex : kNoObject};
}

SimulatedDictionary::Found SimulatedDictionary::Check(std::uint16_t index, std::uint8_t sub,
                                                      std::uint8_t bytes) const {
  const Found found = Read(index, sub);
  if (found.object == nullptr) return found;
  if (found.object->access != Access::kWritable) return {nullptr, kReadOnlyObject};
  if (bytes > found.object->bytes) return {nullptr, kTooLong};
  if (bytes < found.object->bytes) return {nullptr, kTooShort};
  return found;
}

std::vector<SimulatedDictionary::Object>::iterator SimulatedDictionary::Find(std::uint16_t index,
                                                                             std::uint8_t sub) {
  return std::find_if(objects_.begin(), objects_.end(),
                      [&](const Object& object) { return object.index == index && object.sub == sub; });
}

void SimulatedDictionary::Put(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
  const auto found = Find(index, sub);
  if (found != objects_.end()) found->value = value;
}

std::uint32_t SimulatedDictionary::Get(std::uint16_t index, std::uint8_t sub) const {
  const Found found = Read(index, sub);
  return found.object == nullptr ? 0 : found.object->value;
}

std::string SimulatedDictionary::Change(std::string_view text) {
  const std::size_t colon = text.find(':');
  const std::size_t equals = text.find('=');
  if (colon == std::string_view::npos || equals == std::string_view::npos || colon > equals) return kHowToChange;
  std::uint32_t index = 0;
  std::uint32_t sub = 0;
  std::uint32_t value = 0;
  const std::string_view value_text = text.substr(equals + 1);
  const bool gone = value_text == "none";
  if (!ReadNumber(text.substr(0, colon), 16, index) || index > 0xFFFF ||
      !ReadNumber(text.substr(colon + 1, equals - colon - 1), 16, sub) || sub > 0xFF ||
      (!gone && !ReadNumber(value_text, 10, value))) {
    return kHowToChange;
  }
  const auto found = Find(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub));
  if (found == objects_.end()) return "there is no object " + std::string(text.substr(0, equals));
  if (gone) {
    objects_.erase(found);
  } else {
    found->value = value;
  }
  return "";
}

}  // namespace axlecast::cia406
