// The JavaScript client as one module for pages without a bundler: /page/enfilade.js.
export {
  Client, connect, ConnectionFailed, loadSchemas, makeSchemas, pixels, PROTOCOL_VERSION, ServerError,
} from "enfilade-client";
