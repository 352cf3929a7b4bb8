#include "tools/foxglove/lcm_definition.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

constexpr std::array<std::pair<std::string_view, LcmKind>, 9> kPrimitives = {{{"int8_t", LcmKind::kInt8},
                                                                              {"int16_t", LcmKind::kInt16},
                                                                              {"int32_t", LcmKind::kInt32},
                                                                              {"int64_t", LcmKind::kInt64},
                                                                              {"byte", LcmKind::kByte},
                                                                              {"float", LcmKind::kFloat},
                                                                              {"double", LcmKind::kDouble},
                                                                              {"boolean", LcmKind::kBoolean},
                                                                              {"string", LcmKind::kString}}};

std::optional<LcmKind> PrimitiveOf(std::string_view word) {
  const auto found = std::ranges::find(kPrimitives, word, [](const auto& entry) { return entry.first; });
  if (found == kPrimitives.end()) return std::nullopt;
  return found->second;
}

std::string_view NameOf(LcmKind kind) {
  return std::ranges::find(kPrimitives, kind, [](const auto& entry) { return entry.second; })->first;
}

bool IsInteger(LcmKind kind) { return kind <= LcmKind::kByte; }

bool IsWord(char character) {
  return (character >= 'a' && character <= 'z') || (character >= 'A' && character <= 'Z') ||
         (character >= '0' && character <= '9') || character == '_' || character == '.' || character == '-' ||
         character == '+';
}

bool IsName(std::string_view word) {
  return !word.empty() && std::ranges::all_of(word, IsWord) && !(word.front() >= '0' && word.front() <= '9') &&
         word.find_first_of("-+") == std::string_view::npos && word.front() != '.' && word.back() != '.';
}

// Splits a text into words and single characters. Comments and white space separate them.
class Tokens {
 public:
  explicit Tokens(std::string_view text) : text_(text) { Advance(); }

  [[nodiscard]] std::string_view word() const { return word_; }  // empty: the end
  [[nodiscard]] int line() const { return line_; }
  void Advance() {
    SkipSpace();
    std::size_t size = 0;
    while (at_ + size < text_.size() && IsWord(text_[at_ + size])) ++size;
    word_ = text_.substr(at_, std::max<std::size_t>(size, at_ < text_.size() ? 1 : 0));
    at_ += word_.size();
  }

 private:
  void SkipSpace() {
    while (at_ < text_.size()) {
      const std::string_view rest = text_.substr(at_);
      if (rest.starts_with("//")) {
        at_ += std::min(rest.find('\n'), rest.size());
      } else if (rest.starts_with("/*")) {
        const std::size_t end = rest.find("*/", 2);
        const std::size_t size = end == std::string_view::npos ? rest.size() : end + 2;
        line_ += static_cast<int>(std::ranges::count(rest.substr(0, size), '\n'));
        at_ += size;
      } else if (rest.front() == ' ' || (rest.front() >= '\t' && rest.front() <= '\r')) {
        line_ += rest.front() == '\n' ? 1 : 0;
        ++at_;
      } else {
        return;
      }
    }
  }

  std::string_view text_;
  std::string_view word_;
  std::size_t at_ = 0;
  int line_ = 1;
};

class Parser {
 public:
  explicit Parser(std::string_view text) : tokens_(text) {}

  [[nodiscard]] Result<std::vector<LcmStruct>> Parse() {
    while (!tokens_.word().empty() && problem_.empty()) {
      if (Accept("package")) {
        package_ = Name("a name of a package");
        Expect(";");
      } else if (Accept("struct")) {
        ParseStruct();
      } else {
        Fail("expected package or struct");  // an enum, too: lcm-gen 1.3.1 warns that they are obsolete
      }
    }
    if (!problem_.empty()) return Failure(problem_);
    return std::move(types_);
  }

 private:
  void Fail(std::string_view what) {
    if (!problem_.empty()) return;
    const std::string_view word = tokens_.word();
    problem_ = "line " + std::to_string(tokens_.line()) + ": " + std::string(what) + ", not " +
               (word.empty() ? "the end" : Quoted(std::string(word)));
  }
  bool Accept(std::string_view word) {
    if (tokens_.word() != word) return false;
    tokens_.Advance();
    return true;
  }
  void Expect(std::string_view word) {
    if (!Accept(word)) Fail("expected " + Quoted(std::string(word)));
  }
  std::string Name(std::string_view what) {
    if (!IsName(tokens_.word())) Fail("expected " + std::string(what));
    std::string name(tokens_.word());
    tokens_.Advance();
    return name;
  }

  void ParseStruct() {
    LcmStruct type{.package = package_, .name = Name("a name of a struct"), .fields = {}, .constants = {}};
    Expect("{");
    while (problem_.empty() && !Accept("}")) {
      Accept("const") ? ParseConstants(type) : ParseFields(type);
    }
    types_.push_back(std::move(type));
  }

  void ParseConstants(LcmStruct& type) {
    const std::optional<LcmKind> kind = PrimitiveOf(tokens_.word());
    if (!kind || !(IsInteger(*kind) || *kind == LcmKind::kFloat || *kind == LcmKind::kDouble))
      return Fail("expected the type of a constant");
    tokens_.Advance();
    do {
      LcmConstant constant{.name = Name("a name of a constant"), .kind = *kind, .value = {}};
      Expect("=");
      constant.value = tokens_.word();
      if (!IsWord(constant.value.empty() ? ' ' : constant.value.front())) return Fail("expected a number");
      tokens_.Advance();
      type.constants.push_back(std::move(constant));
    } while (problem_.empty() && Accept(","));
    Expect(";");
  }

  void ParseFields(LcmStruct& type) {
    const std::string name = Name("a type");
    const std::optional<LcmKind> kind = PrimitiveOf(name);
    const std::string full = kind                                                       ? ""
                             : name.find('.') == std::string::npos && !package_.empty() ? package_ + '.' + name
                                                                                        : name;
    do {
      LcmField field{.name = Name("a name of a field"),
                     .kind = kind.value_or(LcmKind::kStruct),
                     .type = full,
                     .dimensions = {}};
      while (problem_.empty() && Accept("[")) ParseDimension(type, field);
      type.fields.push_back(std::move(field));
    } while (problem_.empty() && Accept(","));
    Expect(";");
  }

  void ParseDimension(const LcmStruct& type, LcmField& field) {
    LcmDimension dimension{.size = std::string(tokens_.word())};
    const char* const last = dimension.size.data() + dimension.size.size();
    const auto [end, error] = std::from_chars(dimension.size.data(), last, dimension.constant);
    dimension.is_constant = error == std::errc() && end == last;
    if (!dimension.is_constant) {
      const auto size = std::ranges::find(type.fields, dimension.size, &LcmField::name);
      if (size == type.fields.end() || !IsInteger(size->kind) || !size->dimensions.empty())
        return Fail("expected a size: a number, or an integer field before it");
      dimension.field = static_cast<std::size_t>(size - type.fields.begin());
    }
    tokens_.Advance();
    field.dimensions.push_back(std::move(dimension));
    Expect("]");
  }

  Tokens tokens_;
  std::string package_;
  std::vector<LcmStruct> types_;
  std::string problem_;
};

// lcmgen.c, hash_update.
void Update(std::int64_t& hash, char character) {
  hash =
      static_cast<std::int64_t>((static_cast<std::uint64_t>(hash) << 8) ^ static_cast<std::uint64_t>(hash >> 55)) +
      static_cast<signed char>(character);
}

void Update(std::int64_t& hash, std::string_view text) {
  Update(hash, static_cast<char>(text.size()));
  for (const char character : text) Update(hash, character);
}

// The hash of a struct without the structs that it contains.
std::uint64_t OwnHash(const LcmStruct& type) {
  std::int64_t hash = 0x12345678;
  for (const LcmField& field : type.fields) {
    Update(hash, field.name);
    if (field.kind != LcmKind::kStruct) Update(hash, NameOf(field.kind));
    Update(hash, static_cast<char>(field.dimensions.size()));
    for (const LcmDimension& dimension : field.dimensions) {
      Update(hash, dimension.is_constant ? '\0' : '\1');
      Update(hash, dimension.size);
    }
  }
  return static_cast<std::uint64_t>(hash);
}

}  // namespace

std::size_t LcmSizeOf(LcmKind kind) {
  switch (kind) {
    case LcmKind::kInt8:
    case LcmKind::kByte:
    case LcmKind::kBoolean:
      return 1;
    case LcmKind::kInt16:
      return 2;
    case LcmKind::kInt32:
    case LcmKind::kFloat:
      return 4;
    case LcmKind::kInt64:
    case LcmKind::kDouble:
      return 8;
    case LcmKind::kString:
    case LcmKind::kStruct:
      break;
  }
  return 0;
}

Result<> LcmDefinitions::Add(std::string_view text) {
  if (text.size() > kMaxText - bytes_) return Failure("the definitions are larger than 4 MB");
  Result<std::vector<LcmStruct>> types = Parser(text).Parse();
  if (!types) return Failure(types.error());
  bytes_ += text.size();
  by_fingerprint_.clear();
  for (LcmStruct& type : *types) types_[type.FullName()] = std::move(type);
  return {};
}

std::vector<std::string> LcmDefinitions::Finish() {
  std::vector<std::string> problems;
  by_fingerprint_.clear();
  for (const auto& [name, type] : types_) {
    if (std::optional<std::string> problem = ProblemOf(type, 1)) {
      problems.push_back(name + ": " + *problem);
    } else {
      by_fingerprint_[static_cast<std::int64_t>(Hash(type))] = &type;
    }
  }
  return problems;
}

std::optional<std::string> LcmDefinitions::ProblemOf(const LcmStruct& type, std::size_t depth) const {
  if (depth > kMaxDepth) return "its structs contain each other, or are nested more than 16 deep";
  for (const LcmField& field : type.fields) {
    if (field.kind != LcmKind::kStruct) continue;
    const LcmStruct* const inner = Find(field.type);
    if (inner == nullptr) return "the type " + field.type + " is not known: give its file too";
    if (std::optional<std::string> problem = ProblemOf(*inner, depth + 1)) return problem;
  }
  return std::nullopt;
}

std::uint64_t LcmDefinitions::Hash(const LcmStruct& type) const {
  std::uint64_t hash = OwnHash(type);
  for (const LcmField& field : type.fields) {
    if (field.kind == LcmKind::kStruct) hash += Hash(*Find(field.type));
  }
  return (hash << 1) + (hash >> 63);
}

const LcmStruct* LcmDefinitions::Find(const std::string& full_name) const {
  const auto found = types_.find(full_name);
  return found == types_.end() ? nullptr : &found->second;
}

const LcmStruct* LcmDefinitions::Find(std::int64_t fingerprint) const {
  const auto found = by_fingerprint_.find(fingerprint);
  return found == by_fingerprint_.end() ? nullptr : found->second;
}

}  // namespace axlecast
