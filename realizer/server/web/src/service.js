// Requests to the service, with the token in the page's address if it has one.

export const token = new URLSearchParams(location.search).get("token");
const options = token ? { headers: { Authorization: `Bearer ${token}` } } : {};

export const ask = (path) => fetch(path, options);
