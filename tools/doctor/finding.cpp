#include "tools/doctor/finding.h"

#include <utility>

namespace axlecast {
namespace {

// As a shell reads it as one word.
std::string ShellWord(const std::string& text) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./:=@%+,";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

Remedy Run(std::vector<std::string> words) {
  return {.kind = Remedy::Kind::kRun, .words = std::move(words), .path = {}, .text = {}};
}

Remedy Write(std::string path, std::string text) {
  return {.kind = Remedy::Kind::kWrite, .words = {}, .path = std::move(path), .text = std::move(text)};
}

Remedy Append(std::string path, std::string text) {
  return {.kind = Remedy::Kind::kAppend, .words = {}, .path = std::move(path), .text = std::move(text)};
}

Remedy Tell(std::string text) {
  return {.kind = Remedy::Kind::kTell, .words = {}, .path = {}, .text = std::move(text)};
}

std::string LineOf(const Remedy& remedy) {
  switch (remedy.kind) {
    case Remedy::Kind::kRun: {
      std::string line;
      for (const std::string& word : remedy.words) line += (line.empty() ? "" : " ") + ShellWord(word);
      return line;
    }
    case Remedy::Kind::kWrite:
      return "echo " + ShellWord(remedy.text) + " > " + ShellWord(remedy.path);
    case Remedy::Kind::kAppend:
      return "echo " + ShellWord(remedy.text) + " >> " + ShellWord(remedy.path);
    case Remedy::Kind::kTell:
      break;
  }
  return remedy.text;
}

std::string_view SeverityName(Severity severity) {
  switch (severity) {
    case Severity::kError:
      return "error";
    case Severity::kWarning:
      return "warning";
    case Severity::kAdvice:
      break;
  }
  return "advice";
}

}  // namespace axlecast
