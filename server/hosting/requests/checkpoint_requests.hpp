// Handles the requests SaveWorld, RestoreWorld and Upload (checkpoints).
#pragma once

#include <string>
#include <variant>

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

/// Keeps the parts of an upload.
void handleUpload(const RequestContext& context, const v1::Upload& request);
/// The bytes of a request: those that it has, or the upload of its client, which is then forgotten.
/// Names the error's field.
std::variant<std::string, v1::Error> takeBytes(Client& client, const std::string& bytes,
                                               bool uploaded, const std::string& field);
void handleSaveWorld(const RequestContext& context);
void handleRestoreWorld(const RequestContext& context, const v1::RestoreWorld& request);

}  // namespace enfilade::server
