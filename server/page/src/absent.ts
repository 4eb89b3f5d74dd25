// Replaces modules of Node.js that the client imports only there.
export const WebSocket = undefined;
export const readFile = undefined;
