#include "tools/foxglove/ros_schema.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr std::string_view kUtime = "utime";
constexpr std::string_view kFlags = "flags";
constexpr std::string_view kFlagPrefix = "FLAG_";
constexpr std::size_t kFingerprint = 8;  // bytes before the fields
constexpr std::int64_t kMillion = 1'000'000;

constexpr std::string_view kHeaderLine = "std_msgs/Header header\n";
constexpr std::string_view kHeaderFields = "builtin_interfaces/Time stamp\nstring frame_id\n";
constexpr std::string_view kTimeFields = "int32 sec\nuint32 nanosec\n";

// Begins the description of a type that another one contains.
void BeginType(std::string& text, std::string_view name) {
  text.append(80, '=').append("\nMSG: ").append(name).push_back('\n');
}

// What ROS calls a primitive type.
std::string_view RosTypeOf(LcmKind kind) {
  switch (kind) {
    case LcmKind::kInt8:
      return "int8";
    case LcmKind::kInt16:
      return "int16";
    case LcmKind::kInt32:
      return "int32";
    case LcmKind::kInt64:
      return "int64";
    case LcmKind::kByte:
      return "uint8";
    case LcmKind::kFloat:
      return "float32";
    case LcmKind::kDouble:
      return "float64";
    case LcmKind::kBoolean:
      return "bool";
    case LcmKind::kString:
      return "string";
    case LcmKind::kStruct:
      break;
  }
  return "";
}

// "device_info_t" is DeviceInfo.
std::string CamelCase(std::string_view name) {
  if (name.size() > 2 && name.ends_with("_t")) name.remove_suffix(2);
  std::string text;
  bool upper = true;
  for (const char character : name) {
    if (character == '_') {
      upper = true;
      continue;
    }
    text += upper && character >= 'a' && character <= 'z' ? static_cast<char>(character - 'a' + 'A') : character;
    upper = false;
  }
  return text.empty() ? std::string(name) : text;
}

// The size of a list of constant size; nothing if a field states it.
std::optional<std::uint64_t> ConstantSize(const LcmField& field) {
  std::uint64_t size = 1;
  for (const LcmDimension& dimension : field.dimensions) {
    if (!dimension.is_constant) return std::nullopt;
    size *= dimension.constant;
  }
  return size;
}

// Reads an LCM message, big-endian.
class LcmBytes {
 public:
  explicit LcmBytes(Bytes bytes) : rest_(bytes) {}

  [[nodiscard]] std::size_t left() const { return rest_.size(); }
  [[nodiscard]] std::optional<Bytes> Take(std::size_t size) {
    if (size > rest_.size()) return std::nullopt;
    const Bytes taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }

 private:
  Bytes rest_;
};

std::uint64_t BigEndian(Bytes bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

std::int64_t Signed(std::uint64_t value, std::size_t size) {
  const std::size_t shift = 64 - 8 * size;
  return static_cast<std::int64_t>(value << shift) >> shift;
}

// Appends values in CDR: each is aligned to its size, counted from behind the head of 4 bytes.
class CdrWriter {
 public:
  explicit CdrWriter(std::string& text) : text_(text), begin_(text.size() + 4) { text_.append("\0\1\0\0", 4); }

  void Number(std::uint64_t value, std::size_t size) {
    Align(size);
    for (std::size_t i = 0; i < size; ++i) text_ += static_cast<char>(value >> (8 * i));
  }
  void Text(std::string_view value) {
    Number(value.size() + 1, 4);
    text_.append(value).push_back('\0');
  }
  void Swapped(Bytes big_endian) {
    Align(big_endian.size());
    text_.append(big_endian.rbegin(), big_endian.rend());
  }

 private:
  void Align(std::size_t size) {
    while ((text_.size() - begin_) % size != 0) text_ += '\0';
  }

  std::string& text_;
  std::size_t begin_;
};

// Reads one struct after the other, and writes its values.
class Transcoder {
 public:
  Transcoder(const LcmDefinitions& definitions, Bytes fields, CdrWriter& out)
      : definitions_(definitions), in_(fields), out_(out) {}

  // `watched`: the index of a field whose value is returned in `value`.
  [[nodiscard]] bool Struct(const LcmStruct& type, std::size_t watched, std::uint64_t& value) {
    std::vector<std::int64_t> sizes(type.fields.size());
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      const LcmField& field = type.fields[i];
      if (!List(field, sizes, sizes[i])) return false;
      if (i == watched) value = static_cast<std::uint64_t>(sizes[i]);
    }
    return true;
  }
  [[nodiscard]] bool AtEnd() const { return in_.left() == 0; }

 private:
  // `number`: the value of an integer that is not a list.
  [[nodiscard]] bool List(const LcmField& field, const std::vector<std::int64_t>& sizes, std::int64_t& number) {
    if (field.dimensions.empty()) return Value(field, number);
    std::uint64_t count = 1;
    bool constant = true;
    for (const LcmDimension& dimension : field.dimensions) {
      const std::int64_t size = dimension.is_constant ? dimension.constant : sizes[dimension.field];
      if (size < 0) return false;
      constant = constant && dimension.is_constant;
      // Each value has at least one byte.
      if (size != 0 && count > in_.left() / static_cast<std::uint64_t>(size)) return false;
      count *= static_cast<std::uint64_t>(size);
    }
    if (!constant) out_.Number(count, 4);
    std::int64_t ignored = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!Value(field, ignored)) return false;
    }
    return true;
  }

  [[nodiscard]] bool Value(const LcmField& field, std::int64_t& number) {
    if (field.kind == LcmKind::kStruct) {
      std::uint64_t ignored = 0;
      return Struct(*definitions_.Find(field.type), SIZE_MAX, ignored);
    }
    if (field.kind == LcmKind::kString) return Text();
    const std::size_t size = LcmSizeOf(field.kind);
    const std::optional<Bytes> bytes = in_.Take(size);
    if (!bytes) return false;
    number = field.kind == LcmKind::kByte ? bytes->front() : Signed(BigEndian(*bytes), size);
    out_.Swapped(*bytes);
    return true;
  }

  // A text may contain any bytes. Viewers decode UTF-8.
  [[nodiscard]] bool Text() {
    const std::optional<Bytes> size = in_.Take(4);
    if (!size) return false;
    const std::int64_t length = Signed(BigEndian(*size), 4);  // with the NUL
    if (length < 1) return false;
    const std::optional<Bytes> bytes = in_.Take(static_cast<std::size_t>(length));
    if (!bytes || bytes->back() != 0) return false;
    std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size() - 1);
    out_.Text(MendedUtf8(text.substr(0, text.find('\0'))));
    return true;
  }

  const LcmDefinitions& definitions_;
  LcmBytes in_;
  CdrWriter& out_;
};

}  // namespace

RosSchema::RosSchema(const LcmDefinitions& definitions, const LcmStruct& type)
    : definitions_(definitions), type_(type), name_(NameOf(type.FullName())) {
  const LcmField* const first = type.fields.empty() ? nullptr : &type.fields.front();
  has_utime_ =
      first != nullptr && first->name == kUtime && first->kind == LcmKind::kInt64 && first->dimensions.empty();
  const auto flags = std::ranges::find(type.fields, kFlags, &LcmField::name);
  flags_field_ = static_cast<std::size_t>(flags - type.fields.begin());
  if (flags != type.fields.end() && flags->kind == LcmKind::kInt32 && flags->dimensions.empty()) {
    for (const LcmConstant& constant : type.constants) {
      if (!constant.name.starts_with(kFlagPrefix)) continue;
      std::uint32_t bit = 0;
      const bool hexadecimal = constant.value.starts_with("0x");
      const char* const end = constant.value.data() + constant.value.size();
      if (std::from_chars(constant.value.data() + (hexadecimal ? 2 : 0), end, bit, hexadecimal ? 16 : 10).ptr !=
          end)
        continue;
      std::string name = constant.name;
      std::ranges::transform(name, name.begin(),
                             [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
      if (std::ranges::find(type.fields, name, &LcmField::name) == type.fields.end()) flags_.push_back({name, bit});
    }
  }
  std::vector<std::string> described = {type.FullName()};
  if (has_utime_) text_.append(kHeaderLine);
  for (std::size_t i = 0; i < described.size(); ++i) {
    const LcmStruct& each = *definitions.Find(described[i]);
    if (i > 0) BeginType(text_, NameOf(described[i]));
    Describe(each, described);
    if (i > 0) continue;
    for (const Flag& flag : flags_) text_ += "bool " + flag.name + '\n';
  }
  if (!has_utime_) return;
  BeginType(text_, "std_msgs/Header");
  text_.append(kHeaderFields);
  BeginType(text_, "builtin_interfaces/Time");
  text_.append(kTimeFields);
}

std::string RosSchema::NameOf(const std::string& full_name) const {
  const std::size_t dot = full_name.rfind('.');
  std::string package = dot == std::string::npos ? "lcm" : full_name.substr(0, dot);
  std::ranges::replace(package, '.', '_');
  return package + "/msg/" + CamelCase(std::string_view(full_name).substr(dot == std::string::npos ? 0 : dot + 1));
}

void RosSchema::Describe(const LcmStruct& type, std::vector<std::string>& described) {
  for (const LcmField& field : type.fields) {
    text_ += field.kind == LcmKind::kStruct ? NameOf(field.type) : std::string(RosTypeOf(field.kind));
    if (!field.dimensions.empty()) {
      const std::optional<std::uint64_t> size = ConstantSize(field);
      text_ += '[' + (size ? std::to_string(*size) : std::string()) + ']';
    }
    text_ += ' ' + field.name + '\n';
    if (field.kind == LcmKind::kStruct && std::ranges::find(described, field.type) == described.end())
      described.push_back(field.type);
  }
  for (const LcmConstant& constant : type.constants) {
    text_ += std::string(RosTypeOf(constant.kind)) + ' ' + constant.name + '=' + constant.value + '\n';
  }
}

bool RosSchema::Transcode(Bytes message, std::string& cdr) const {
  if (message.size() < kFingerprint) return false;
  CdrWriter out(cdr);
  if (has_utime_) {
    const std::int64_t utime = UtimeOf(message);
    const std::int64_t second = utime / kMillion - (utime % kMillion < 0 ? 1 : 0);
    out.Number(static_cast<std::uint64_t>(second), 4);
    out.Number(static_cast<std::uint64_t>((utime - second * kMillion) * 1'000), 4);
    out.Text("");
  }
  Transcoder transcoder(definitions_, message.subspan(kFingerprint), out);
  std::uint64_t flags = 0;
  if (!transcoder.Struct(type_, flags_.empty() ? SIZE_MAX : flags_field_, flags) || !transcoder.AtEnd())
    return false;
  for (const Flag& flag : flags_) out.Number((flags & flag.bit) != 0 ? 1 : 0, 1);
  return true;
}

std::int64_t RosSchema::UtimeOf(Bytes message) const {
  if (!has_utime_ || message.size() < kFingerprint + 8) return 0;
  return static_cast<std::int64_t>(BigEndian(message.subspan(kFingerprint, 8)));
}

}  // namespace axlecast
