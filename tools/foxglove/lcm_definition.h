#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// The type of one value of an LCM message.
enum class LcmKind : std::uint8_t {
  kInt8,
  kInt16,
  kInt32,
  kInt64,
  kByte,
  kFloat,
  kDouble,
  kBoolean,
  kString,
  kStruct
};

// Returns the bytes of a value on the wire; 0 for a text or a struct.
[[nodiscard]] std::size_t LcmSizeOf(LcmKind kind);

struct LcmDimension {
  std::string size;  // as written: a number, or the name of a field of the struct
  std::uint32_t constant = 0;
  bool is_constant = false;
  std::size_t field = 0;  // not constant: the index of the field that states the size
};

struct LcmField {
  std::string name;
  LcmKind kind = LcmKind::kInt8;
  std::string type;  // of a struct: with its package
  std::vector<LcmDimension> dimensions;
};

struct LcmConstant {
  std::string name;
  LcmKind kind = LcmKind::kInt8;
  std::string value;  // as written
};

struct LcmStruct {
  std::string package;
  std::string name;  // without the package
  std::vector<LcmField> fields;
  std::vector<LcmConstant> constants;

  [[nodiscard]] std::string FullName() const { return package.empty() ? name : package + '.' + name; }
};

// The types of .lcm files, by their names and fingerprints (LCM 1.3.1, "LCM Type Specification"; the fingerprint as lcm-gen computes it).
class LcmDefinitions {
 public:
  LcmDefinitions() = default;
  LcmDefinitions(LcmDefinitions&&) = default;
  LcmDefinitions& operator=(LcmDefinitions&&) = default;
  LcmDefinitions(const LcmDefinitions&) = delete;  // it contains pointers to its own types
  LcmDefinitions& operator=(const LcmDefinitions&) = delete;

  static constexpr std::size_t kMaxText = 4 << 20;  // bytes of all texts
  static constexpr std::size_t kMaxDepth = 16;      // of structs within structs

  // Adds the types of a text, which may contain several files. Fails if it is not a definition: the error names the line. A type that
  // is known already is replaced.
  [[nodiscard]] Result<> Add(std::string_view text);
  // Computes the fingerprints. Returns why types cannot be used, one sentence for each: a type that they contain is not known, they are
  // nested too deeply, or contain themselves.
  [[nodiscard]] std::vector<std::string> Finish();

  // Return null if it is not known. Valid until Add.
  [[nodiscard]] const LcmStruct* Find(const std::string& full_name) const;
  [[nodiscard]] const LcmStruct* Find(std::int64_t fingerprint) const;

 private:
  [[nodiscard]] std::optional<std::string> ProblemOf(const LcmStruct& type, std::size_t depth) const;
  [[nodiscard]] std::uint64_t Hash(const LcmStruct& type) const;

  std::map<std::string, LcmStruct> types_;
  std::map<std::int64_t, const LcmStruct*> by_fingerprint_;
  std::size_t bytes_ = 0;
};

}  // namespace axlecast
