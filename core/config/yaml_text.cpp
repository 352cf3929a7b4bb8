#include "core/config/yaml_text.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cstddef>
#include <exception>
#include <map>
#include <sstream>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/messages/origin.h"

namespace axlecast {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

// Returns the place after the quote that opens at `begin`; npos if the text does not close it.
std::size_t EndOfQuote(std::string_view text, std::size_t begin) {
  const char quote = text[begin];
  for (std::size_t at = begin + 1; at < text.size(); ++at) {
    const bool doubled = quote == '\'' && text.substr(at, 2) == "''";
    if (doubled || (quote == '"' && text[at] == '\\')) {
      ++at;
    } else if (text[at] == quote) {
      return at + 1;
    }
  }
  return std::string_view::npos;
}

// What a line of YAML leaves open for the next.
struct OpenParts {
  int flow = 0;                       // depth of [ and {
  bool in_block = false;              // in a text of | or >: its quotes are characters
  std::size_t block_indentation = 0;  // of the line that begins this text
};

// Returns the place of a quote that opens a value and is not closed in the line.
std::optional<std::size_t> OpenQuoteOf(std::string_view line, OpenParts& open) {
  const std::size_t indentation = line.find_first_not_of(" \t\r");
  if (indentation == std::string_view::npos || (open.in_block && indentation > open.block_indentation))
    return std::nullopt;
  open.in_block = false;
  bool begins_value = true;
  for (std::size_t at = indentation; at < line.size(); ++at) {
    const char c = line[at];
    const bool before_blank = at + 1 == line.size() || IsBlank(line[at + 1]);
    if (IsBlank(c)) continue;
    if (c == '#' && (at == 0 || IsBlank(line[at - 1]))) break;
    if ((c == '|' || c == '>') && begins_value && open.flow == 0) {
      open.in_block = true;
      open.block_indentation = indentation;
      break;
    }
    if ((c == '"' || c == '\'') && begins_value) {
      const std::size_t end = EndOfQuote(line, at);
      if (end == std::string_view::npos) return at;
      at = end - 1;
      begins_value = false;
      continue;
    }
    const bool opens_flow = (c == '[' || c == '{') && (begins_value || open.flow > 0);
    if (opens_flow) ++open.flow;
    if ((c == ']' || c == '}') && open.flow > 0) --open.flow;
    begins_value = opens_flow || (c == ',' && open.flow > 0) || (c == ':' && before_blank) ||
                   ((c == '-' || c == '?') && before_blank && begins_value);
  }
  return std::nullopt;
}

constexpr int kDeepest = 32;
constexpr int kMaxNodes = 100'000;  // aliases can make a small text a huge tree

void AddOpenQuote(const OpenQuote& open, const std::string& found, ConfigErrors& errors) {
  YAML::Mark mark;
  mark.line = open.line;
  mark.column = open.column;
  errors.Add(mark, Text("not YAML: the quote %c that opens here is not closed in its line (%s)", open.quote,
                        found.c_str()));
}

class TreeCheck {
 public:
  TreeCheck(const std::string& text, ConfigErrors& errors) : errors_(errors), open_(FindOpenQuote(text)) {}

  // False when the walk was given up.
  bool Walk(const YAML::Node& node, int depth) {
    if (++nodes_ > kMaxNodes) return GiveUp(node, "more than " + std::to_string(kMaxNodes) + " values");
    CheckEnd(node);
    if (depth > kDeepest) return GiveUp(node, "nested deeper than " + std::to_string(kDeepest) + " levels");
    if (node.IsSequence()) {
      for (const auto& item : node) {
        if (!Walk(item, depth + 1)) return false;
      }
    }
    return !node.IsMap() || WalkMap(node, depth);
  }

 private:
  bool WalkMap(const YAML::Node& node, int depth) {
    std::map<std::string, YAML::Mark, std::less<>> seen;
    for (const auto& pair : node) {
      CheckEnd(pair.first);
      if (!pair.first.IsScalar()) {
        errors_.Add(pair.first.Mark(), "a key must be plain text");
      } else if (const auto [first, added] = seen.emplace(pair.first.Scalar(), pair.first.Mark()); !added) {
        errors_.Add(pair.first.Mark(), "key " + Quoted(pair.first.Scalar()) +
                                           " is given twice here; the first is in " +
                                           errors_.PlaceText(first->second, pair.first.Mark()));
      }
      if (!Walk(pair.second, depth + 1)) return false;
    }
    return true;
  }

  // yaml-cpp takes the end of the text for the end of a quoted value, whose tag is "!".
  void CheckEnd(const YAML::Node& node) {
    if (!open_ || open_->closed || !node.IsScalar() || node.Tag() != "!") return;
    if (node.Mark().line != open_->line || node.Mark().column != open_->column) return;
    AddOpenQuote(*open_, "nor in a later one", errors_);
  }

  bool GiveUp(const YAML::Node& node, const std::string& why) {
    errors_.Add(node.Mark(), why + ": this is no machine's file");
    return false;
  }

  ConfigErrors& errors_;
  std::optional<OpenQuote> open_;
  int nodes_ = 0;
};

// What the parser's own words leave the reader to guess.
std::string Remedy(const std::string& text, const YAML::Mark& mark) {
  std::size_t begin = 0;
  for (int line = 0; line < mark.line && begin != std::string::npos; ++line) {
    begin = text.find('\n', begin);
    if (begin != std::string::npos) ++begin;
  }
  if (begin == std::string::npos) return "";
  const std::size_t end = text.find_first_not_of(" \t", begin);
  const std::string indentation = text.substr(begin, end == std::string::npos ? end : end - begin);
  return indentation.find('\t') == std::string::npos ? "" : " (the indentation contains a tab: use spaces)";
}

void AddSyntaxError(const std::string& text, const YAML::Exception& error, ConfigErrors& errors) {
  const std::optional<OpenQuote> open = FindOpenQuote(text);
  if (open && (error.mark.is_null() || open->line <= error.mark.line)) {
    AddOpenQuote(*open, "found in line " + std::to_string(errors.PlaceOf(error.mark).line) + ": " + error.msg,
                 errors);
  } else {
    errors.Add(error.mark, "not YAML: " + error.msg + Remedy(text, error.mark));
  }
}

class DocumentStarts final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { last_ = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

  [[nodiscard]] const YAML::Mark& last() const { return last_; }

 private:
  YAML::Mark last_;
};

// Returns the place of a second document. YAML::LoadAll is no help: with some texts (", a") it never ends.
std::optional<YAML::Mark> SecondDocument(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentStarts starts;
  if (!parser.HandleNextDocument(starts) || !parser.HandleNextDocument(starts)) return std::nullopt;
  return starts.last();
}

YAML::Node LoadDocument(const std::string& text, ConfigErrors& errors) {
  const YAML::Node nothing(YAML::NodeType::Undefined);
  const YAML::Node document = YAML::Load(text);
  if (const std::optional<YAML::Mark> second = SecondDocument(text)) {
    errors.Add(*second,
               "what begins here does not belong to the document before it ('---'?): one file is one machine");
    return nothing;
  }
  if (document.IsNull()) {
    errors.AddOfLastFile("the file is empty: it must describe a machine, see docs/configuration.md");
    return nothing;
  }
  return document;
}

void AppendQuoted(std::string& text, const std::string& scalar) {
  text += '"';
  for (const char c : scalar) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  text += '"';
}

void Append(std::string& text, const YAML::Node& node) {
  if (node.IsMap()) {
    std::map<std::string, YAML::Node> entries;
    for (const auto& pair : node) entries.emplace(pair.first.Scalar(), pair.second);
    text += '{';
    for (const auto& [key, value] : entries) {
      if (text.back() != '{') text += ',';
      AppendQuoted(text, key);
      text += ':';
      Append(text, value);
    }
    text += '}';
  } else if (node.IsSequence()) {
    text += '[';
    for (const auto& item : node) {
      if (text.back() != '[') text += ',';
      Append(text, item);
    }
    text += ']';
  } else {
    AppendQuoted(text, node.IsScalar() ? node.Scalar() : "");
  }
}

}  // namespace

std::optional<OpenQuote> FindOpenQuote(std::string_view text) {
  OpenParts open;
  for (int number = 0; !text.empty(); ++number) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (const auto column = OpenQuoteOf(line, open)) {
      return OpenQuote{.line = number,
                       .column = static_cast<int>(*column),
                       .quote = text[*column],
                       .closed = EndOfQuote(text, *column) != std::string_view::npos};
    }
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return std::nullopt;
}

YAML::Node ParseYaml(const std::string& text, ConfigErrors& errors) {
  const YAML::Node nothing(YAML::NodeType::Undefined);
  if (text.size() > kMaxYamlText) {
    errors.AddOfLastFile("the file has " + std::to_string(text.size()) + " bytes, at most " +
                         std::to_string(kMaxYamlText) + " are read: is it the right file?");
    return nothing;
  }
  try {
    const YAML::Node document = LoadDocument(text, errors);
    return document.IsDefined() && TreeCheck(text, errors).Walk(document, 0) ? document : nothing;
  } catch (const YAML::Exception& error) {
    AddSyntaxError(text, error, errors);
  } catch (const std::exception& error) {
    errors.AddOfLastFile(std::string("not YAML: ") + error.what());
  }
  return nothing;
}

std::int64_t ConfigHash(const YAML::Node& device) {
  std::string text;
  Append(text, device);
  return NameHash(text);
}

}  // namespace axlecast
