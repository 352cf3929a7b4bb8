#include "tools/axlecast/run/web_server_options.h"

#include <filesystem>

#include "platform/os/secret_file.h"
#include "tools/web/web_access.h"

namespace axlecast {

SecretPlace SecretFileAt(const std::string& file) {
  SecretPlace place;
  place.file = std::filesystem::absolute(file);
  place.group_may_read = true;
  return place;
}

void WebServerOptions::AddTo(CLI::App& command, const std::string& port_text, const std::string& token_text,
                             const std::string& clients_text) {
  command.add_option("--bind", bind, "Serve on this address instead of the file's (127.0.0.1: only this host)")
      ->type_name("ADDRESS");
  command.add_option("--port", port, port_text)->check(CLI::Range(0, 65535))->type_name("N");
  command.add_option("--tls-cert", certificate, "PEM file of the certificate and its chain")->type_name("FILE");
  command.add_option("--tls-key", key, "PEM file of its key, mode 0600 or 0640")->type_name("FILE");
  command.add_option("--token-file", token_file, token_text)->type_name("FILE");
  command.add_option("--name", names, "Accept this name of the host in requests, in addition to its own")
      ->type_name("NAME");
  command.add_option("--clients", clients, clients_text)
      ->check(CLI::Range(1, 200))
      ->capture_default_str()
      ->type_name("N");
}

WebConfig WebServerOptions::Over(WebConfig web) const {
  web.bind = bind.value_or(web.bind);
  web.port = port.value_or(web.port);
  web.certificate = certificate.value_or(web.certificate);
  web.key = key.value_or(web.key);
  if (token_file) web.token = SecretFileAt(*token_file);
  web.names.insert(web.names.end(), names.begin(), names.end());
  return web;
}

Result<Secret> ReadWebSecrets(const WebConfig& web) {
  SecretFiles files;
  if (!web.key.empty()) {
    const Result<Secret> key = files.Read(SecretFileAt(web.key));
    if (!key) return Failure("tls_key: " + key.error().text);
  }
  if (web.token.empty()) return Secret();
  Result<Secret> token = files.Read(web.token);
  if (!token) return Failure("token: " + token.error().text);
  if (token->text().size() >= WebAccess::kMinTokenLength) return token;
  return Failure("token: shorter than " + std::to_string(WebAccess::kMinTokenLength) +
                 " characters: it could be guessed; create one: (umask 077; openssl rand -hex 16 > FILE)");
}

}  // namespace axlecast
