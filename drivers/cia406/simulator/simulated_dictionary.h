#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast::cia406 {

// The object dictionary of a simulated CANopen device (CiA 301 7.4): what can be read and written at which index
// and sub-index, and what is wrong about a try, as the abort codes of table 22.
class SimulatedDictionary {
 public:
  enum class Access : std::uint8_t { kConstant, kReadOnly, kWritable };
  struct Object {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::uint8_t bytes = 0;  // 1, 2, 4; 0: a text, longer than an expedited transfer holds
    Access access = Access::kReadOnly;
    std::uint32_t value = 0;  // of a text its length
  };
  struct Found {
    const Object* object = nullptr;  // null: `abort`
    std::uint32_t abort = 0;
  };

  void Add(const Object& object) { objects_.push_back(object); }
  void AddRecord(std::uint16_t index, std::uint8_t highest_sub);  // its sub-index 0

  [[nodiscard]] Found Read(std::uint16_t index, std::uint8_t sub) const;
  // Whether `bytes` bytes may be written there; the object keeps its value until Put.
  [[nodiscard]] Found Check(std::uint16_t index, std::uint8_t sub, std::uint8_t bytes) const;
  // Sets the value of an object that exists, whoever may write it.
  void Put(std::uint16_t index, std::uint8_t sub, std::uint32_t value);
  [[nodiscard]] std::uint32_t Get(std::uint16_t index, std::uint8_t sub) const;  // 0 when it does not exist

  // "1017:00=500" sets an object, "1018:04=none" takes it away. Empty when done, else what would be right.
  [[nodiscard]] std::string Change(std::string_view text);

 private:
  [[nodiscard]] std::vector<Object>::iterator Find(std::uint16_t index, std::uint8_t sub);

  std::vector<Object> objects_;
};

}  // namespace axlecast::cia406
